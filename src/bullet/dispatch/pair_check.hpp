/// Check of a sphere pair against Bullet's own algorithm.
#pragma once

#include <jfpx/contact.hpp>

#include "src/bullet/dispatch/point_fields.hpp"

class btCollisionObject;
class btDispatcher;
struct btDispatcherInfo;

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {

/// Runs btSphereSphereCollisionAlgorithm on a scratch manifold and compares the result with the
/// collider's contact (null: no contact) and, unless `manifold` is null, with the current manifold.
/// If the contact is not finite, only this property is compared, because Bullet computes such
/// contacts. Global contact callbacks are disabled during the check.
/// @return the first field that differs.
std::optional<FieldDifference> check_pair(btDispatcher* dispatcher, const btDispatcherInfo& info,
                                          const btCollisionObject& body_a,
                                          const btCollisionObject& body_b,
                                          const PairContact* contact,
                                          const btPersistentManifold& thresholds,
                                          const btPersistentManifold* manifold);

}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
