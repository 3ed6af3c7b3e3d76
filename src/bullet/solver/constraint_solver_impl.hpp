/// State of a ConstraintSolver and the stages in which it solves a group.
#pragma once

#include <jfpx/bullet/constraint_solver.hpp>

#include "src/bullet/solver/contact_scan.hpp"
#include "src/bullet/solver/gpu_island_solver.hpp"
#include "src/bullet/solver/group_batch.hpp"
#include "src/bullet/solver/group_choice.hpp"
#include "src/contact_solver/sequential_impulse/cpu/row_solver.hpp"

#include <LinearMath/btQuickprof.h>

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {

inline constexpr std::size_t kBodiesPerChunk = 64;
inline constexpr std::size_t kBlocksPerChunk = 16;
/// Minimum number of manifolds for setting up a group with several threads.
inline constexpr std::size_t kSharedManifolds = 2048;

/// Each stage is defined in the file that the comment above its declarations names.
struct ConstraintSolver::Impl {
  using Steps = std::array<const void*, 8>;

  ConstraintSolver& self;
  const Steps own_steps;                        ///< functions of this class, without overrides
  const btSingleConstraintRowSolver own_split;  ///< split impulse row solver of Bullet
  const bool thread_safe_library;               ///< see thread_safe_library.hpp
  cpu::RowSolver solver;
  ThreadPool calling_thread{1};
  std::optional<GpuIslandSolver> device;  ///< always present after construction
  const bool may_choose;                  ///< false if the user has selected a device
  std::size_t minimum_batch;
  GroupChoice choice;
  ConstraintSolverStats stats;
  ContactScan scan;
  std::vector<std::uint8_t> flags;  ///< by id: BodyFlag bits
  /// Whether any body has a factor other than 1, and whether any contact has an initial impulse.
  std::atomic<bool> factors{false}, warm{false};

  // State of one group, valid while the group is solved.
  std::span<btCollisionObject*> bodies;
  std::span<btTypedConstraint*> joints;
  std::vector<std::int32_t> joint_ids;       ///< by solver body; see JointRows
  std::vector<UnlistedBody> joint_unlisted;  ///< unlisted bodies of joints
  const btContactSolverInfo* info = nullptr;
  rows::RowSettings settings{};
  bool on_device = false;
  bool is_small = false;  ///< the loops over the group take less time than waking threads
  /// Whether the groups of this solver may be solved on any thread. A program's functions for
  /// profile zones and its allocator are called on the stepping thread only.
  bool is_helper = false;
  GroupBatch batch;

  Impl(ConstraintSolver& owner, const ConstraintSolverOptions& options);

  /// A profile zone of Bullet during its lifetime, unless the solver is a helper.
  class Zone {
   public:
    Zone(const Impl& impl, const char* name) {
      if (!impl.is_helper) zone_.emplace(name);
    }

   private:
    std::optional<CProfileSample> zone_;
  };

  /// Solves the group. @return the reason if it is not solved; all data that Bullet's solver reads
  ///   is then unchanged
  std::optional<SolverFallback> solve(std::span<btPersistentManifold* const> manifolds);

  // group_fallback.cpp
  Steps steps() const;
  int max_iterations() const;
  /// The reason why the group is not solved here, if any.
  std::optional<SolverFallback> fallback_reason(
      std::span<btPersistentManifold* const> manifolds) const;
  bool depends_on_thread_safety(std::span<btPersistentManifold* const> manifolds) const;
  SolverFallback restore(SolverFallback reason);

  // group_bodies.cpp
  void set_up_bodies();
  void set_up_body(std::size_t i, btCollisionObject* object);
  void set_up_joints();
  void set_up_joint_rows();
  void set_up_unlisted_bodies(std::span<btPersistentManifold* const> manifolds);
  void pack(const btSolverBody& body, std::size_t id);
  void start(const btSolverBody& body, std::size_t id);

  // group_rows.cpp
  void set_up_rows();
  void set_up_contacts();
  void prefetch_block(std::uint32_t block) const;
  void set_up_block(std::uint32_t block);
  bool has_rolling_friction(std::uint32_t block) const;
  void set_up_rolling_frictions(std::uint32_t block, const cpu::RowSolver::BlockIds& ids,
                                const Real* normals);

  // constraint_solver.cpp
  void set_mode(const btContactSolverInfo& settings_of_step);
  void set_up(std::span<btPersistentManifold* const> manifolds);
  rows::RowSweepReport solve_rows();
  rows::RowSweepReport sweep();
  DeviceGroup device_group();
  /// The threads for setting up the group and writing its results.
  ThreadPool& pool() { return is_small ? calling_thread : solver.pool(); }
  std::uint32_t directions() const {
    return (info->m_solverMode & SOLVER_USE_2_FRICTION_DIRECTIONS) != 0 ? 2 : 1;
  }

  // group_write_back.cpp
  void write_back();
  void write_back_impulses(std::uint32_t block);
  void write_back_bodies();
  void record_analytics(const rows::RowSweepReport& report, int manifold_count);
};

}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
