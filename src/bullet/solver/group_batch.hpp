/// Solves the groups of a step that depend on nothing of each other, each on one thread.
#pragma once

#include <jfpx/bullet/constraint_solver.hpp>

#include "src/base/sized_chooser.hpp"
#include "src/base/thread_pool.hpp"

#include <BulletDynamics/ConstraintSolver/btTypedConstraint.h>

#include <cstddef>
#include <memory>
#include <optional>
#include <span>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {

/// The arguments of ConstraintSolver::solveGroup() that differ between the groups of a step.
struct SolverGroup {
  std::span<btCollisionObject*> bodies;
  std::span<btPersistentManifold*> manifolds;
  std::span<btTypedConstraint*> joints;
};

/// Calls solveGroup() with a group.
void solve_group(btConstraintSolver& solver, const SolverGroup& group,
                 const btContactSolverInfo& info, btIDebugDraw* drawer, btDispatcher* dispatcher);

/// A group is concurrent if the moving bodies of its contacts and joints are in its own islands. If
/// a contact or joint of any group has a movable body of another island, the order of the groups
/// matters, and none is concurrent. Each thread has a solver of its own. Other groups are solved
/// afterwards, in order, by the user's solver.
class GroupBatch {
 public:
  explicit GroupBatch(const ConstraintSolverOptions& options);
  ~GroupBatch();

  /// The batch of a solver, or null if it solves one group at a time: it has another class, a
  /// single thread, or a GPU alone.
  static GroupBatch* of(btConstraintSolver& solver);

  /// Has the results of ConstraintSolver::solveGroup() for each group, in order.
  void solve(ConstraintSolver& solver, std::span<const SolverGroup> groups,
             const btContactSolverInfo& info, btIDebugDraw* drawer, btDispatcher* dispatcher);

 private:
  /// Is a class of its own, because operator new of ConstraintSolver calls Bullet's allocator.
  struct Helper {
    ConstraintSolver solver;
  };
  struct Outcome {
    bool is_alone = false;   ///< it may be solved concurrently
    bool is_solved = false;  ///< it has been
    btScalar residual = 0;
    btSolverAnalyticsData analytics{};
  };

  bool select(ConstraintSolver& solver, std::span<const SolverGroup> groups,
              const btContactSolverInfo& info);
  bool has_enough(const ConstraintSolver::Impl& impl, std::span<const SolverGroup> groups);
  bool are_independent(ThreadPool& pool, std::span<const SolverGroup> groups);
  std::size_t helpers_in_use(ConstraintSolver& solver) const;
  bool reserve(ConstraintSolver& solver, std::span<const SolverGroup> groups);
  void run(ConstraintSolver& solver, std::span<const SolverGroup> groups,
           const btContactSolverInfo& info);
  void solve_one(ConstraintSolver* helper, const SolverGroup& group,
                 const btContactSolverInfo& info, Outcome* outcome);
  void adopt(ConstraintSolver* solver, const Outcome& outcome);

  const ConstraintSolverOptions options_;
  std::vector<std::unique_ptr<Helper>> helpers_;  ///< by number of a thread in a batch
  std::vector<std::uint32_t> concurrent_;         ///< groups that may be, the largest first
  std::size_t manifolds_ = 0;                     ///< of these groups
  std::vector<Outcome> outcomes_;                 ///< by group
  /// Between solving groups concurrently and one after the other, by number of bits of manifolds_.
  SizedChooser chooser_;
};

}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
