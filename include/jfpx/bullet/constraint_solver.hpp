/// Constraint solver for Bullet programs with results that are bit-identical to Bullet's solver.
#pragma once

#include <jfpx/bullet/abi.hpp>
#include <jfpx/sphere_collider.hpp>

#include <BulletDynamics/ConstraintSolver/btSequentialImpulseConstraintSolver.h>

#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {

struct ConstraintSolverOptions {
  /// Computing device of the sweeps. `automatic`: the CPU, or a GPU where it has measured faster.
  /// `cuda`: a GPU for all groups that it supports; the CPU for groups with joints, with
  /// anisotropic friction, or with more than 1024 iterations.
  Backend backend = Backend::automatic;
  int device = 0;                         ///< cuda: ordinal of the GPU
  unsigned threads = 1;                   ///< at most 256; 0: one per core
  SimdLevel simd = SimdLevel::automatic;  ///< vector instructions for rows: AVX2 or none
  /// Bullet's own code solves groups with fewer manifolds, for every backend. It also solves groups
  /// with little parallelism if it has measured faster, except with 0 or with Backend::cuda.
  std::size_t minimum_batch = 24;
};

/// Reason why a group was solved by Bullet's own code.
enum class SolverFallback : std::uint8_t {
  small,          ///< fewer manifolds than the minimum
  overridden,     ///< a subclass overrides a step of Bullet's solver, such as convertContacts()
  mode,           ///< random order, cached friction directions, no iterations, or more than 65,536
  row_solver,     ///< the user, or a subclass, has set a row solver
  constraints,    ///< a constraint of a class that Bullet does not define
  not_finite,     ///< a value is infinite or NaN; Bullet repeats the group to produce its NaNs
  out_of_memory,  ///< memory for the group could not be allocated
  measured,       ///< few rows are independent, and Bullet's own code has measured faster, or is
                  ///< being measured
  thread_safe,  ///< Bullet has BT_THREADSAFE, and its solver treats a body of the group differently
  rounding,     ///< the rounding mode of the thread is not to nearest
};
inline constexpr std::size_t kSolverFallbacks = 10;

/// Returns a short text for a table, for example "small group".
JFPX_BULLET_API std::string_view to_string(SolverFallback fallback) noexcept;

struct ConstraintSolverStats {
  std::uint64_t groups = 0;      ///< groups solved by jfpx
  std::uint64_t on_device = 0;   ///< groups solved by jfpx on the GPU
  std::uint64_t concurrent = 0;  ///< groups solved by jfpx, each on one thread, beside other groups
  std::uint64_t contacts = 0;    ///< contacts in the groups solved by jfpx
  std::uint64_t joints = 0;      ///< constraints in the groups solved by jfpx
  std::uint64_t sweeps = 0;      ///< sweeps over the rows of these groups
  std::array<std::uint64_t, kSolverFallbacks> fallbacks{};  ///< groups, by SolverFallback
  /// Why the CPU permanently replaces the GPU; empty if the GPU has not failed.
  std::string device_failure;
};

/// A btSequentialImpulseConstraintSolver that solves independent rows in parallel, in vector lanes
/// and in threads. Velocities, transforms, impulses, friction directions and analytics are
/// bit-identical to those of btSequentialImpulseConstraintSolver: rows depend on each other only
/// through moving bodies, and the rows of each body are solved in Bullet's order.
///
/// In a DynamicsWorld, several threads also solve several groups at a time, if no other group may
/// share what the solution of a group changes, as a kinematic body may be shared.
///
/// The base class solves the groups that this class does not support; stats() counts them by
/// reason. Programs that include Bullet's headers need -ffp-contract=off, which linking
/// jfpx::bullet adds. As in Bullet, only one thread at a time may use a solver; different solvers
/// are independent.
class JFPX_BULLET_API ConstraintSolver : public btSequentialImpulseConstraintSolver {
 public:
  BT_DECLARE_ALIGNED_ALLOCATOR();

  /// @throws InvalidArgument for more than 256 threads; BackendUnavailable if the backend is `cuda`
  ///   and no usable GPU is available.
  explicit ConstraintSolver(const ConstraintSolverOptions& options = {});
  ~ConstraintSolver() override;
  ConstraintSolver(const ConstraintSolver&) = delete;
  ConstraintSolver& operator=(const ConstraintSolver&) = delete;

  btScalar solveGroup(btCollisionObject** bodies, int body_count, btPersistentManifold** manifolds,
                      int manifold_count, btTypedConstraint** constraints, int constraint_count,
                      const btContactSolverInfo& info, btIDebugDraw* debug_drawer,
                      btDispatcher* dispatcher) override;

  std::size_t minimum_batch() const noexcept;
  void set_minimum_batch(std::size_t manifolds) noexcept;

  const ConstraintSolverStats& stats() const noexcept;
  void reset_stats();  ///< keeps `device_failure`, because a failed GPU is not used again

 private:
  friend struct ConstraintSolverTestAccess;
  friend class GroupBatch;
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
