/// Transfer of the results of a group to Bullet's manifolds, joints, bodies and analytics.
#include "src/bullet/chunks.hpp"
#include "src/bullet/solver/constraint_solver_impl.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {

void ConstraintSolver::Impl::write_back() {
  const Zone zone(*this, "solveGroupCacheFriendlyFinish");
  if (on_device) {
    device->write_back(device_group());
  } else if (settings.warm_start) {
    in_chunks(pool(), solver.blocks(), kBlocksPerChunk, [&](std::size_t first, std::size_t last) {
      for (std::size_t i = first; i < last; ++i) {
        write_back_impulses(static_cast<std::uint32_t>(i));
      }
    });
  }
  if (!joints.empty()) {
    self.writeBackJoints(0, self.m_tmpSolverNonContactConstraintPool.size(), *info);
    self.m_tmpSolverNonContactConstraintPool.resizeNoInitialize(0);
  }
  write_back_bodies();
  self.m_tmpSolverBodyPool.resizeNoInitialize(0);
}

void ConstraintSolver::Impl::write_back_impulses(std::uint32_t block) {
  const std::size_t lanes = solver.lanes();
  const Real* contact = solver.contact_rows(block) + rows::kRowImpulse * lanes;
  const Real* friction = solver.friction_rows(block) + rows::kRowImpulse * lanes;
  const Real* other = solver.friction_rows(block, directions() - 1) + rows::kRowImpulse * lanes;
  const std::uint32_t* contacts = solver.contacts_of(block);
  for (std::size_t lane = 0; lane < lanes; ++lane) {
    if (contacts[lane] == cpu::RowSolver::kNoContact) return;
    btManifoldPoint& point = scan.contacts()[contacts[lane]].get();
    point.m_appliedImpulse = contact[lane];
    point.m_appliedImpulseLateral1 = friction[lane];
    if (directions() == 2) point.m_appliedImpulseLateral2 = other[lane];
  }
}

void ConstraintSolver::Impl::write_back_bodies() {
  const auto count = static_cast<std::size_t>(self.m_tmpSolverBodyPool.size());
  in_chunks(pool(), count, kBodiesPerChunk, [&](std::size_t first, std::size_t last) {
    for (std::size_t i = first; i < last; ++i) {
      btSolverBody& body = self.m_tmpSolverBodyPool[static_cast<int>(i)];
      const Real *v = solver.velocity(i + 1), *p = solver.push_velocity(i + 1);
      body.m_deltaLinearVelocity.setValue(v[0], v[1], v[2]);
      body.m_deltaAngularVelocity.setValue(v[4], v[5], v[6]);
      body.m_pushVelocity.setValue(p[0], p[1], p[2]);
      body.m_turnVelocity.setValue(p[4], p[5], p[6]);
    }
    self.writeBackBodies(static_cast<int>(first), static_cast<int>(last), *info);
  });
}

void ConstraintSolver::Impl::record_analytics(const rows::RowSweepReport& report,
                                              int manifold_count) {
  self.m_leastSquaresResidual = report.residual;
  btSolverAnalyticsData& data = self.m_analyticsData;
  ++data.m_numSolverCalls;
  data.m_numIterationsUsed = report.iterations;
  data.m_islandId = bodies.empty() ? -2 : (bodies[0]->getCompanionId() < 0 ? -1 : 0);
  data.m_numBodies = static_cast<int>(bodies.size());
  data.m_numContactManifolds = manifold_count;
  data.m_remainingLeastSquaresResidual = report.residual;
}

}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
