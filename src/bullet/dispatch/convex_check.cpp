/// Check of sphere-box and sphere-plane pairs against Bullet's own algorithm.
#include "src/bullet/dispatch/convex_check.hpp"

#include "src/bullet/dispatch/body_wrapper.hpp"

#include <BulletCollision/CollisionDispatch/btManifoldResult.h>

#include <algorithm>
#include <utility>

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {

std::optional<FieldDifference> check_update(btCollisionAlgorithm& algorithm,
                                            const btDispatcherInfo& info,
                                            const btCollisionObject& body_a,
                                            const btCollisionObject& body_b,
                                            const btPersistentManifold& before,
                                            btPersistentManifold* manifold) {
  const btPersistentManifold ours = std::exchange(*manifold, before);
  const btCollisionObjectWrapper a = wrapper_of(body_a);
  const btCollisionObjectWrapper b = wrapper_of(body_b);
  btManifoldResult result(&a, &b);
  algorithm.processCollision(&a, &b, info, &result);
  const btPersistentManifold expected = std::exchange(*manifold, ours);

  FieldComparison compare;
  compare("number of points", expected.getNumContacts(), ours.getNumContacts());
  for (int i = 0; i < expected.getNumContacts() && !compare.first(); ++i) {
    compare_points(expected.getContactPoint(i), ours.getContactPoint(i), &compare);
  }
  return compare.first();
}

void ConvexCheck::remember(const SphereBatch& batch) {
  before_.clear();
  for (std::size_t i = 0; i < batch.pairs().size(); ++i) {
    const PairKind kind = batch.kind(i);
    if (kind == PairKind::other || kind == PairKind::spheres) continue;
    before_.push_back({static_cast<std::uint32_t>(i), *batch.manifold(i)});
  }
}

}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
