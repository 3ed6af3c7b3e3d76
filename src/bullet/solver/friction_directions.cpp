/// Friction directions of btSequentialImpulseConstraintSolver::convertContact() in Bullet 3.24; see
/// the header.
#include "src/bullet/solver/friction_directions.hpp"

#include "src/bullet/solver/rolling_friction_rows.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {
namespace {

void put_lane(Real* to, std::size_t lanes, const btVector3& v) {
  for (std::size_t i = 0; i < 3; ++i) to[i * lanes] = v.m_floats[i];
}

}  // namespace

void set_friction_directions(const ContactRef& contact, const rows::RowSettings& settings,
                             std::size_t lanes, const Real* second, Real* one, Real* two) {
  constexpr int kMode = btCollisionObject::CF_ANISOTROPIC_FRICTION;
  btManifoldPoint& point = contact.get();
  point.m_lateralFrictionDir1.setValue(one[0], one[lanes], one[2 * lanes]);
  if (second != nullptr) {
    // Not setValue(): Bullet does not change the fourth component.
    for (std::size_t i = 0; i < 3; ++i) point.m_lateralFrictionDir2.m_floats[i] = second[i * lanes];
  }
  if (contact.anisotropic) {
    apply_anisotropic_friction(contact, &point.m_lateralFrictionDir1, kMode);
    put_lane(one, lanes, point.m_lateralFrictionDir1);
  }
  if (two == nullptr) return;
  if (second == nullptr) {
    point.m_lateralFrictionDir2 = point.m_lateralFrictionDir1.cross(point.m_normalWorldOnB);
    point.m_lateralFrictionDir2.normalize();
  }
  if (contact.anisotropic) apply_anisotropic_friction(contact, &point.m_lateralFrictionDir2, kMode);
  put_lane(two, lanes, point.m_lateralFrictionDir2);
  if (second != nullptr && !settings.friction_follows_velocity) {
    point.m_contactPointFlags |= BT_CONTACT_FLAG_LATERAL_FRICTION_INITIALIZED;
  }
}

}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
