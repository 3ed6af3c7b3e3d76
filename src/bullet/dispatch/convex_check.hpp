/// Check of sphere-box and sphere-plane pairs against Bullet's own algorithm.
#pragma once

#include "src/bullet/dispatch/point_fields.hpp"
#include "src/bullet/dispatch/sphere_batch.hpp"

#include <vector>

class btCollisionAlgorithm;
struct btDispatcherInfo;

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {

/// Runs `algorithm` on the manifold `before` and compares the result with the current manifold,
/// which does not change.
/// @return the first field that differs.
std::optional<FieldDifference> check_update(btCollisionAlgorithm& algorithm,
                                            const btDispatcherInfo& info,
                                            const btCollisionObject& body_a,
                                            const btCollisionObject& body_b,
                                            const btPersistentManifold& before,
                                            btPersistentManifold* manifold);

/// Copies of the manifolds with persistent points before a dispatch.
class ConvexCheck {
 public:
  void remember(const SphereBatch& batch);
  /// Calls check(pair, manifold before) for each stored pair that is not in `excluded`, which is
  /// ascending.
  template <class Check>
  void for_each(std::span<const std::uint32_t> excluded, const Check& check) const {
    for (const Before& before : before_) {
      if (std::binary_search(excluded.begin(), excluded.end(), before.pair)) continue;
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
