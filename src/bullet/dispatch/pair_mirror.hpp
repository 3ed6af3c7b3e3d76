/// What the engine remembers of the pairs of a pair cache from one dispatch to the next.
#pragma once

#include <jfpx/contact.hpp>

#include "src/base/thread_pool.hpp"
#include "src/bullet/dispatch/proxy_table.hpp"

#include <BulletCollision/BroadphaseCollision/btBroadphaseProxy.h>
#include <BulletCollision/BroadphaseCollision/btCollisionAlgorithm.h>
#include <BulletCollision/BroadphaseCollision/btDispatcher.h>

#include <array>
#include <span>
#include <vector>

class btPersistentManifold;

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {

/// Pairs handled by one thread at a time.
inline constexpr std::size_t kPairChunk = 4096;

/// What Bullet's algorithm of a pair is.
enum class PairKind : std::uint8_t {
  other,         ///< none yet, or one that only Bullet can run
  spheres,       ///< btSphereSphereCollisionAlgorithm with a manifold
  convex,        ///< btConvexConvexAlgorithm with a manifold, without perturbation
  convex_plane,  ///< btConvexPlaneCollisionAlgorithm with a manifold, the plane second
  plane_convex,  ///< the same, the plane first
};

/// Who made the algorithms of the pairs.
struct PairOwner {
  const btDispatcher* dispatcher;
  /// Whether forget() is called for every manifold that this dispatcher releases. If so, the
  /// manifold of an algorithm is read once; if not, in every refresh(): nobody can tell whether an
  /// algorithm was destroyed and another one made in its place.
  bool tells_releases;
};

/// One entry a pair, in the order of the pair array. An entry is good for as long as the array
/// names the same proxies and the same algorithm, and the algorithm's manifold has not been
/// released. Nothing is ever read through a remembered pointer before that is established.
class PairMirror {
 public:
  void refresh(std::span<const btBroadphasePair> pairs, const PairOwner& owner, ThreadPool& pool);
  /// A manifold is about to be released.
  void forget(const btPersistentManifold* manifold) noexcept;
  /// After refresh() has thrown: nothing that is remembered may be used.
  void forget_all() noexcept { lost_ = true; }

  /// The numbers of the two proxies of every pair.
  std::span<const SpherePair> pairs() const { return pairs_; }
  PairKind kind(std::size_t i) const { return links_[i].kind(); }
  /// Null for PairKind::other.
  btPersistentManifold* manifold(std::size_t i) const { return links_[i].manifold(); }
  const ProxyTable& proxies() const { return proxies_; }

 private:
  /// The manifold, the kind, and whether the link may be kept, else it is read again every time: in
  /// one word, because all links are streamed through twice a dispatch.
  class Link {
   public:
    Link() = default;
    Link(btPersistentManifold* manifold, PairKind kind, bool lasting)
        : bits_(reinterpret_cast<std::uintptr_t>(manifold) | static_cast<std::uintptr_t>(kind) |
                (lasting ? 0 : kFleeting)) {}
    /// False for null, and for a pool of the user's that is not aligned as Bullet's are.
    static bool can_hold(const btPersistentManifold* manifold) {
      return manifold != nullptr &&
             (reinterpret_cast<std::uintptr_t>(manifold) & (kKind | kFleeting)) == 0;
    }
    btPersistentManifold* manifold() const {
      // NOLINTNEXTLINE(performance-no-int-to-ptr): the word also holds the kind
      return reinterpret_cast<btPersistentManifold*>(bits_ & ~(kKind | kFleeting));
    }
    PairKind kind() const { return static_cast<PairKind>(bits_ & kKind); }
    bool lasting() const { return (bits_ & kFleeting) == 0; }

   private:
    static constexpr std::uintptr_t kKind = 7, kFleeting = 8;
    std::uintptr_t bits_ = 0;
  };
  static Link read_link(btCollisionAlgorithm* algorithm, const PairOwner& owner);

  struct Key {
    const btBroadphaseProxy* proxy0 = nullptr;
    const btBroadphaseProxy* proxy1 = nullptr;
    const btCollisionAlgorithm* algorithm = nullptr;
  };
  void resize(std::size_t pairs);
  void clear();
  void sort_releases();
  std::array<std::uint64_t, 2> release_bits_of(const btPersistentManifold* manifold) const;
  bool was_released(const btPersistentManifold* manifold) const;
  std::size_t find_changed(std::span<const btBroadphasePair> pairs, std::size_t begin,
                           std::size_t end, std::uint32_t* changed) const;
  void update(std::span<const btBroadphasePair> pairs, std::span<const std::uint32_t> changed,
              const PairOwner& owner);

  ProxyTable proxies_;
  std::vector<Key> keys_;
  std::vector<SpherePair> pairs_;
  std::vector<Link> links_;
  std::vector<std::uint32_t> changed_;
  std::vector<std::size_t> changed_counts_;  ///< by chunk
  std::vector<const btPersistentManifold*> released_;
  std::vector<std::uint64_t> release_bits_;  ///< a set with false positives, which cost a look
  int release_shift_ = 0;
  bool lost_ = false;  ///< what is remembered is of no use, or too much was released to remember
};

}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
