/// Recomputes pairs of a sphere and a box or a plane with Bullet's own algorithm and compares.
#pragma once

#include "src/bullet/dispatch/point_fields.hpp"
#include "src/bullet/dispatch/sphere_batch.hpp"

#include <vector>

class btCollisionAlgorithm;
struct btDispatcherInfo;

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {

/// Lets `algorithm` start from `before` and compares what it makes of the manifold with what the
/// manifold is now. The manifold keeps what it has.
/// @return the first field that differs.
std::optional<FieldDifference> check_update(btCollisionAlgorithm& algorithm,
                                            const btDispatcherInfo& info,
                                            const btCollisionObject& body_a,
                                            const btCollisionObject& body_b,
                                            const btPersistentManifold& before,
                                            btPersistentManifold* manifold);

/// Manifolds with points that persist, as they were before a dispatch.
class ConvexCheck {
 public:
  void remember(const SphereBatch& batch);
  /// Calls check(pair, manifold before) for each remembered pair that is not among those `left`,
  /// which are ascending.
  template <class Check>
  void for_each(std::span<const std::uint32_t> left, const Check& check) const {
    for (const Before& before : before_) {
      if (std::binary_search(left.begin(), left.end(), before.pair)) continue;
      check(before.pair, before.manifold);
    }
  }

 private:
  struct Before {
    std::uint32_t pair;
    btPersistentManifold manifold;
  };
  std::vector<Before> before_;
};

}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
