/// Follows gResolveSingleConstraintRowGeneric of Bullet 3.24; see the header.
#include "src/bullet/solver/joint_rows.hpp"

#include "src/bullet/exact_class.hpp"

#include <btBulletDynamicsCommon.h>

#include <algorithm>
#include <typeinfo>

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {
namespace {

btVector3 load(const Real* v) { return {v[0], v[1], v[2]}; }
void store(Real* to, const btVector3& v) { std::copy_n(v.m_floats, 3, to); }

std::size_t slot_of(std::int32_t id) { return static_cast<std::size_t>(id < 0 ? ~id : id); }

/// Applies the impulse to one body.
void apply(cpu::RowSolver& solver, std::int32_t id, const btVector3& axis,
           const btVector3& response, btScalar impulse) {
  if (id < 0) return;
  const Real* factors = solver.factors(slot_of(id));
  Real* velocity = solver.velocity(slot_of(id));
  const btVector3 linear = axis * load(factors);
  store(velocity, load(velocity) + linear * impulse * load(factors + 4));
  store(velocity + 4, load(velocity + 4) + response * (impulse * load(factors + 8)));
}

/// A class compiled with -fno-rtti is not a class of Bullet.
bool is_known_joint(const btTypedConstraint& constraint) {
  static const std::type_info* const kKnown[] = {&typeid(btPoint2PointConstraint),
                                                 &typeid(btHingeConstraint),
                                                 &typeid(btHingeAccumulatedAngleConstraint),
                                                 &typeid(btSliderConstraint),
                                                 &typeid(btConeTwistConstraint),
                                                 &typeid(btGeneric6DofConstraint),
                                                 &typeid(btGeneric6DofSpringConstraint),
                                                 &typeid(btGeneric6DofSpring2Constraint),
                                                 &typeid(btFixedConstraint),
                                                 &typeid(btUniversalConstraint),
                                                 &typeid(btHinge2Constraint),
                                                 &typeid(btGearConstraint)};
  const std::type_info* const type = type_info_of(constraint);
  return type != nullptr &&
         std::any_of(std::begin(kKnown), std::end(kKnown),
                     [&](const std::type_info* known) { return *known == *type; });
}

}  // namespace

bool are_known_joints(std::span<btTypedConstraint* const> joints) {
  return std::all_of(joints.begin(), joints.end(),
                     [](const btTypedConstraint* joint) { return is_known_joint(*joint); });
}

void JointRows::sweep(int iteration, cpu::RowResidual* residual) {
  for (btSolverConstraint& row : rows_) {
    if (iteration >= row.m_overrideNumSolverIterations) continue;
    const btScalar change = solve(row);
    const btScalar squared = change * change;
    if (squared > residual->largest) residual->largest = squared;
    if (squared != squared) residual->broken = true;
  }
}

btScalar JointRows::solve(btSolverConstraint& row) {
  const std::int32_t a = ids_[static_cast<std::size_t>(row.m_solverBodyIdA)];
  const std::int32_t b = ids_[static_cast<std::size_t>(row.m_solverBodyIdB)];
  const Real *va = solver_.velocity(slot_of(a)), *vb = solver_.velocity(slot_of(b));
  const btScalar before = row.m_appliedImpulse;
  btScalar impulse = row.m_rhs - before * row.m_cfm;
  const btScalar velocity_a =
      row.m_contactNormal1.dot(load(va)) + row.m_relpos1CrossNormal.dot(load(va + 4));
  const btScalar velocity_b =
      row.m_contactNormal2.dot(load(vb)) + row.m_relpos2CrossNormal.dot(load(vb + 4));
  impulse -= velocity_a * row.m_jacDiagABInv;
  impulse -= velocity_b * row.m_jacDiagABInv;
  const btScalar sum = before + impulse;
  if (sum < row.m_lowerLimit) {
    impulse = row.m_lowerLimit - before;
    row.m_appliedImpulse = row.m_lowerLimit;
  } else if (sum > row.m_upperLimit) {
    impulse = row.m_upperLimit - before;
    row.m_appliedImpulse = row.m_upperLimit;
  } else {
    row.m_appliedImpulse = sum;
  }
  apply(solver_, a, row.m_contactNormal1, row.m_angularComponentA, impulse);
  apply(solver_, b, row.m_contactNormal2, row.m_angularComponentB, impulse);
  return static_cast<btScalar>(impulse * (1. / row.m_jacDiagABInv));
}

}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
