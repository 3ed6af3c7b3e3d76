/// Recomputes a sphere pair with Bullet's own algorithm and compares.
#pragma once

#include <jfpx/contact.hpp>

#include "src/bullet/dispatch/point_fields.hpp"

class btCollisionObject;
class btDispatcher;
struct btDispatcherInfo;

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {

/// Runs btSphereSphereCollisionAlgorithm on a scratch manifold and compares the outcome with the
/// collider's contact, null if it found none, and, unless `manifold` is null, with the manifold as
/// it is now. Of a contact that is left to Bullet (has_stocks_bits()) the collider's numbers may be
/// others. Global contact callbacks are taken off meanwhile.
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
