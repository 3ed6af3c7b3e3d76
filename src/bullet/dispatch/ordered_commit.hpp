/// The commit of pairs one by one in Bullet's order, for dispatches that somebody listens to.
#pragma once

#include "src/bullet/dispatch/unordered_commit.hpp"

#include <BulletCollision/BroadphaseCollision/btOverlappingPairCache.h>

#include <functional>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {

/// One walk over all pairs, driven by the pair cache itself, so that the order is Bullet's for
/// every kind of cache. A pair that touches is written in place if nobody could hear it, and goes
/// through Bullet's near callback otherwise, as everything that is not two spheres.
class OrderedCommit {
 public:
  /// Called with each sphere pair behind its visit, and whether its manifold is now what the
  /// contacts say; false if a filter may have kept it as it was.
  using Visited = std::function<void(std::size_t i, bool current)>;

  /// Decides what the walk does at each pair, as the manifolds are now. `ask_all` when the
  /// dispatcher's class may override needsCollision. The only part that can throw by itself.
  CommitCounts plan(const SphereBatch& batch, std::span<const PairContact> touching, bool ask_all);
  /// @return manifolds written.
  std::uint64_t run(btCollisionDispatcher& dispatcher, btOverlappingPairCache& cache,
                    const btDispatcherInfo& info, btDispatcher* argument, const SphereBatch& batch,
                    std::span<const btBroadphasePair> pairs, std::span<const PairContact> touching,
                    const Visited& visited);

 private:
  enum class Action : std::uint8_t {
    stock,   ///< not two spheres, or not (yet) a pair with Bullet's own sphere-sphere algorithm
    skip,    ///< does not touch and has no points: nothing could change
    ask,     ///< as skip, but a user's override of the collision filter must be asked
    commit,  ///< touches or has points
  };
  class Walk;

  static constexpr std::uint32_t kNone = ~std::uint32_t{0};

  std::vector<Action> actions_;
  std::vector<std::uint32_t> contacts_;  ///< by pair: the number of its contact, or kNone
};

}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
