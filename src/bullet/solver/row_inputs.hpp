/// Conversion of Bullet's settings, bodies and contacts to the inputs of the row solver.
#pragma once

#include "src/contact_solver/sequential_impulse/row_layout.hpp"

#include <BulletCollision/NarrowPhaseCollision/btManifoldPoint.h>
#include <BulletDynamics/ConstraintSolver/btContactSolverInfo.h>
#include <BulletDynamics/ConstraintSolver/btSolverBody.h>

#include <cstddef>

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {

rows::RowSettings row_settings(const btContactSolverInfo& info);
/// Adds gyroscopic impulses like btSequentialImpulseConstraintSolver::convertBodies(). The body
/// must have an original body.
void add_gyroscopic_impulses(const btContactSolverInfo& info, btSolverBody* body);
/// Writes the kBodyFields numbers that gather_body() reads. The body must have an original body.
void pack_body(const btSolverBody& body, Real* to);
/// Writes kFactorFields numbers.
void pack_factors(const btSolverBody& body, Real* to);
/// Writes the contact to its lane of a block of inputs.
void pack_contact(const btManifoldPoint& point, const btContactSolverInfo& info, std::size_t lanes,
                  Real* to);

}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
