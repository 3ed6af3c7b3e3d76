/// Selection of concurrent groups, and the threads that solve them; see the header.
#include "src/bullet/solver/group_batch.hpp"

#include "src/base/floating_point.hpp"
#include "src/bullet/chunks.hpp"
#include "src/bullet/exact_class.hpp"
#include "src/bullet/solver/constraint_solver_impl.hpp"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <new>

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {
namespace {

using Clock = std::chrono::steady_clock;

/// First of the two alternatives of a chooser; the other is to solve one group after the other.
constexpr std::size_t kConcurrent = 0;
/// Threads divide the rows of larger groups. A GPU may solve them, if there is one.
constexpr std::size_t kMostManifolds = kSharedManifolds;
/// Fewer manifolds take less time than waking threads.
constexpr std::size_t kLeastManifolds = 64;
constexpr std::size_t kItemsPerChunk = 512;

/// The largest number of rows of a joint: two limits, a motor and a spring along and about each
/// axis (btGeneric6DofSpring2Constraint).
constexpr std::size_t kMostRowsOfJoint = 24;

/// What the contacts and joints of a group refer to, in ascending order of what that prevents.
enum class Reach : std::uint8_t {
  island,        ///< moving bodies of the islands of the group only: it may be solved concurrently
  fixed_bodies,  ///< also kinematic bodies, or fixed ones with a mass, which get a number while the
                 ///< group is solved
  other_islands,  ///< also movable bodies of other groups, which must be solved in order
};

Reach reach_of(const btCollisionObject& a, const btCollisionObject& b) {
  const int island = a.getIslandTag() >= 0 ? a.getIslandTag() : b.getIslandTag();
  Reach result = Reach::island;
  for (const btCollisionObject* object : {&a, &b}) {
    const btRigidBody* const body = btRigidBody::upcast(object);
    if (body == nullptr) continue;
    if (!object->isStaticOrKinematicObject()) {
      if (object->getIslandTag() != island) return Reach::other_islands;
    } else if (object->isKinematicObject() || body->getInvMass() != 0) {
      result = Reach::fixed_bodies;
    }
  }
  return result;
}
bool is_large(const SolverGroup& group) {
  return std::max(group.manifolds.size(), group.joints.size()) > kMostManifolds;
}
Reach reach_of(std::span<btPersistentManifold* const> manifolds) {
  Reach result = Reach::island;
  for (const btPersistentManifold* manifold : manifolds) {
    result = std::max(result, reach_of(*manifold->getBody0(), *manifold->getBody1()));
  }
  return result;
}
Reach reach_of(std::span<btTypedConstraint* const> joints) {
  Reach result = Reach::island;
  for (const btTypedConstraint* joint : joints) {
    result = std::max(result, reach_of(joint->getRigidBodyA(), joint->getRigidBodyB()));
    // Several joints may add to one feedback.
    if (joint->getJointFeedback() != nullptr) result = std::max(result, Reach::fixed_bodies);
  }
  return result;
}

}  // namespace

void solve_group(btConstraintSolver& solver, const SolverGroup& group,
                 const btContactSolverInfo& info, btIDebugDraw* drawer, btDispatcher* dispatcher) {
  solver.solveGroup(group.bodies.data(), static_cast<int>(group.bodies.size()),
                    group.manifolds.data(), static_cast<int>(group.manifolds.size()),
                    group.joints.data(), static_cast<int>(group.joints.size()), info, drawer,
                    dispatcher);
}

GroupBatch::GroupBatch(const ConstraintSolverOptions& options)
    : options_{.backend = Backend::cpu, .threads = 1, .simd = options.simd, .minimum_batch = 0} {}
GroupBatch::~GroupBatch() = default;

GroupBatch* GroupBatch::of(btConstraintSolver& solver) {
  if (!is_exactly<ConstraintSolver>(solver)) return nullptr;
  ConstraintSolver::Impl& impl = *static_cast<ConstraintSolver&>(solver).impl_;
  return impl.may_choose && impl.solver.pool().threads() > 1 ? &impl.batch : nullptr;
}

void GroupBatch::solve(ConstraintSolver& solver, std::span<const SolverGroup> groups,
                       const btContactSolverInfo& info, btIDebugDraw* drawer,
                       btDispatcher* dispatcher) {
  solver.impl_->set_mode(info);
  bool is_concurrent = select(solver, groups, info);
  const bool has_choice = is_concurrent && solver.minimum_batch() > 0;
  Clock::time_point start;
  if (has_choice) {
    is_concurrent = chooser_.choose(manifolds_) == kConcurrent;
    start = Clock::now();
  }
  if (is_concurrent) run(solver, groups, info);
  for (std::size_t i = 0; i < groups.size(); ++i) {
    if (i < outcomes_.size() && outcomes_[i].is_solved) {
      adopt(&solver, outcomes_[i]);
    } else {
      solve_group(solver, groups[i], info, drawer, dispatcher);
    }
  }
  if (!has_choice) return;
  const std::chrono::duration<double, std::micro> us = Clock::now() - start;
  chooser_.record(us.count());
}

/// Selects the groups to solve concurrently. @returns whether there are enough
bool GroupBatch::select(ConstraintSolver& solver, std::span<const SolverGroup> groups,
                        const btContactSolverInfo& info) {
  ConstraintSolver::Impl& impl = *solver.impl_;
  concurrent_.clear();
  try {
    concurrent_.reserve(groups.size());
    outcomes_.assign(groups.size(), Outcome{});
  } catch (const std::bad_alloc&) {
    outcomes_.clear();  // of the last step
    return false;
  }
  impl.info = &info;
  for (std::size_t i = 0; i < groups.size(); ++i) {
    const SolverGroup& group = groups[i];
    if (group.manifolds.empty() || is_large(group)) continue;
    impl.bodies = group.bodies;
    impl.joints = group.joints;
    if (!impl.fallback_reason(group.manifolds)) {
      concurrent_.push_back(static_cast<std::uint32_t>(i));
    }
  }
  if (!has_enough(impl, groups) || !are_independent(impl.solver.pool(), groups)) return false;
  std::erase_if(concurrent_, [&](std::uint32_t i) { return !outcomes_[i].is_alone; });
  std::ranges::sort(concurrent_, [&](std::uint32_t i, std::uint32_t k) {
    const std::size_t of_i = groups[i].manifolds.size(), of_k = groups[k].manifolds.size();
    return of_i != of_k ? of_i > of_k : i < k;
  });
  return has_enough(impl, groups);
}

bool GroupBatch::has_enough(const ConstraintSolver::Impl& impl,
                            std::span<const SolverGroup> groups) {
  manifolds_ = 0;
  for (const std::uint32_t i : concurrent_) manifolds_ += groups[i].manifolds.size();
  return concurrent_.size() > 1 && (impl.minimum_batch == 0 || manifolds_ >= kLeastManifolds);
}

/// Whether the order of the groups does not matter. Finds those that may be solved concurrently.
bool GroupBatch::are_independent(ThreadPool& pool, std::span<const SolverGroup> groups) {
  std::atomic<bool> are_independent{true};
  const auto note = [&](Reach reach) {
    if (reach == Reach::other_islands) are_independent.store(false, std::memory_order_relaxed);
    return reach == Reach::island;
  };
  pool.run(groups.size(), [&](std::size_t i) {
    if (is_large(groups[i])) return;
    const bool has_own_contacts =
        note(reach_of(std::span<btPersistentManifold* const>(groups[i].manifolds)));
    const bool has_own_joints =
        note(reach_of(std::span<btTypedConstraint* const>(groups[i].joints)));
    outcomes_[i].is_alone = has_own_contacts && has_own_joints;
  });
  const auto note_all = [&](const auto& all) {
    in_chunks(pool, all.size(), kItemsPerChunk, [&](std::size_t first, std::size_t last) {
      note(reach_of(all.subspan(first, last - first)));
    });
  };
  for (const SolverGroup& group : groups) {
    if (!is_large(group)) continue;
    note_all(std::span<btPersistentManifold* const>(group.manifolds));
    note_all(std::span<btTypedConstraint* const>(group.joints));
  }
  return are_independent;
}

std::size_t GroupBatch::helpers_in_use(ConstraintSolver& solver) const {
  return std::min<std::size_t>(concurrent_.size(), solver.impl_->solver.pool().threads());
}

/// Reserves what the helpers cannot allocate on other threads.
bool GroupBatch::reserve(ConstraintSolver& solver, std::span<const SolverGroup> groups) {
  std::size_t bodies = 0, joints = 0;
  for (const std::uint32_t i : concurrent_) {
    bodies = std::max(bodies, groups[i].bodies.size());
    joints = std::max(joints, groups[i].joints.size());
  }
  try {
    while (helpers_.size() < helpers_in_use(solver)) {
      helpers_.push_back(std::unique_ptr<Helper>(new Helper{ConstraintSolver(options_)}));
      helpers_.back()->solver.impl_->is_helper = true;
    }
  } catch (const std::bad_alloc&) {
    return false;
  }
  for (std::size_t i = 0; i < helpers_in_use(solver); ++i) {
    ConstraintSolver& own = helpers_[i]->solver;
    own.m_tmpSolverBodyPool.reserve(static_cast<int>(bodies) + 1);  // and Bullet's fixed body
    own.m_tmpConstraintSizesPool.reserve(static_cast<int>(joints));
    own.m_tmpSolverNonContactConstraintPool.reserve(static_cast<int>(kMostRowsOfJoint * joints));
  }
  return true;
}

void GroupBatch::run(ConstraintSolver& solver, std::span<const SolverGroup> groups,
                     const btContactSolverInfo& info) {
  ConstraintSolver::Impl& impl = *solver.impl_;
  if (!reserve(solver, groups)) return;
  const ConstraintSolver::Impl::Zone zone(impl, "solveGroup");
  std::atomic<std::size_t> next{0};
  impl.solver.pool().run(helpers_in_use(solver), [&](std::size_t thread) {
    for (std::size_t k = next++; k < concurrent_.size(); k = next++) {
      const std::uint32_t i = concurrent_[k];
      solve_one(&helpers_[thread]->solver, groups[i], info, &outcomes_[i]);
    }
  });
  for (const std::unique_ptr<Helper>& helper : helpers_) {
    ConstraintSolverStats& stats = helper->solver.impl_->stats;
    impl.stats.groups += stats.groups;
    impl.stats.concurrent += stats.groups;
    impl.stats.contacts += stats.contacts;
    impl.stats.joints += stats.joints;
    impl.stats.sweeps += stats.sweeps;
    stats = {};
  }
}

/// Thread-safe for different helpers and groups. Leaves a group unchanged that it does not solve.
void GroupBatch::solve_one(ConstraintSolver* helper, const SolverGroup& group,
                           const btContactSolverInfo& info, Outcome* outcome) {
  ConstraintSolver::Impl& impl = *helper->impl_;
  impl.info = &info;
  impl.bodies = group.bodies;
  impl.joints = group.joints;
  const TrapsMasked masked;
  if (impl.solve(group.manifolds)) return;
  outcome->is_solved = true;
  outcome->residual = helper->m_leastSquaresResidual;
  outcome->analytics = helper->m_analyticsData;
}

/// Makes the results that a solver keeps of its last group those of a concurrent group.
void GroupBatch::adopt(ConstraintSolver* solver, const Outcome& outcome) {
  btSolverAnalyticsData& data = solver->m_analyticsData;
  const int calls = data.m_numSolverCalls + 1;
  data = outcome.analytics;
  data.m_numSolverCalls = calls;
  solver->m_leastSquaresResidual = outcome.residual;
}

}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
