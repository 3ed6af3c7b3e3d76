/// Rows as in btSequentialImpulseConstraintSolver::convertContact() of Bullet 3.24; see the header.
#include "src/bullet/solver/rolling_friction_rows.hpp"

#include <BulletDynamics/ConstraintSolver/btSequentialImpulseConstraintSolver.h>

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {
namespace {

/// Access to a protected function of Bullet's solver.
struct Access : btSequentialImpulseConstraintSolver {
  using btSequentialImpulseConstraintSolver::applyAnisotropicFriction;
};

std::size_t row_of(std::uint32_t t, std::size_t lanes) {
  return std::size_t{t} * rows::kRollingFields * lanes;
}

}  // namespace

void apply_anisotropic_friction(const ContactRef& contact, btVector3* axis, int mode) {
  for (const btCollisionObject* object :
       {contact.manifold->getBody0(), contact.manifold->getBody1()}) {
    // NOLINTNEXTLINE(cppcoreguidelines-pro-type-const-cast): the function only reads
    Access::applyAnisotropicFriction(const_cast<btCollisionObject*>(object), *axis, mode);
  }
}

void pack_rolling_friction(const btManifoldPoint& point, std::size_t lanes, Real* to) {
  to[rows::kRollingPresent * lanes] = 1;
  for (std::uint32_t t = 0; t < rows::kRollingRows; ++t) {
    to[row_of(t, lanes) + rows::kRollingStrength * lanes] =
        t == 0 ? point.m_combinedSpinningFriction : point.m_combinedRollingFriction;
  }
}

void scale_rolling_axes(const ContactRef& contact, std::size_t lanes, Real* to) {
  for (std::uint32_t t = 1; t < rows::kRollingRows; ++t) {
    Real* const axis = to + row_of(t, lanes) + rows::kRollingAxis * lanes;
    btVector3 scaled(axis[0], axis[lanes], axis[2 * lanes]);
    apply_anisotropic_friction(contact, &scaled,
                               btCollisionObject::CF_ANISOTROPIC_ROLLING_FRICTION);
    for (std::size_t i = 0; i < 3; ++i) axis[i * lanes] = scaled.m_floats[i];
  }
}

}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
