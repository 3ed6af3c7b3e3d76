/// Translates Bullet's settings, bodies and contacts for the row solver.
#pragma once

#include "src/contact_solver/row_layout.hpp"

#include <BulletCollision/NarrowPhaseCollision/btManifoldPoint.h>
#include <BulletDynamics/ConstraintSolver/btContactSolverInfo.h>
#include <BulletDynamics/ConstraintSolver/btSolverBody.h>

#include <cstddef>

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {

rows::RowSettings row_settings(const btContactSolverInfo& info);
/// As btSequentialImpulseConstraintSolver::convertBodies(). The body must have an original.
void add_gyroscopic_impulses(const btContactSolverInfo& info, btSolverBody* body);
/// Fills kBodyFields numbers as gather_body() reads them. The body must have an original.
void pack_body(const btSolverBody& body, Real* to);
/// Fills kFactorFields numbers.
void pack_factors(const btSolverBody& body, Real* to);
/// Writes the contact into its lane of a block of inputs.
void pack_contact(const btManifoldPoint& point, const btContactSolverInfo& info, std::size_t lanes,
                  Real* to);

}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
