/// The constraint solver that puts jfpx into a Bullet program: one line changes, every bit stays.
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

class GroupSolver;

namespace bullet {

struct ConstraintSolverOptions {
  Build headers = Build::of_these_headers;  ///< leave it: what the caller includes
  /// Who sweeps over the rows. `automatic`: x86, or a GPU where that has been faster. `cuda`: a GPU
  /// whenever it can (not groups with joints or with friction that depends on the direction).
  Backend backend = Backend::automatic;
  int device = 0;                         ///< cuda: ordinal of the GPU
  unsigned threads = 1;                   ///< 0: one per core, at most 256
  SimdLevel simd = SimdLevel::automatic;  ///< vectors of rows: AVX2 or none
  /// Manifolds below which a group is left to Bullet's own code.
  std::size_t minimum_batch = 24;
};

/// Why a group was left to Bullet's own code.
enum class SolverFallback : std::uint8_t {
  small,        ///< fewer manifolds than the minimum
  overridden,   ///< a subclass overrides a step of Bullet's, such as convertContacts()
  mode,         ///< random order, cached directions of friction; no iterations, or over 65,536
  row_solver,   ///< the user, or a subclass, has set a row solver
  constraints,  ///< a constraint of a class that is not Bullet's
  not_finite,   ///< something left the finite numbers: done again by Bullet, for its NaNs
  out_of_memory,
};
inline constexpr std::size_t kSolverFallbacks = 7;

/// A short text for a table, for example "small group".
JFPX_API std::string_view to_string(SolverFallback fallback) noexcept;

struct ConstraintSolverStats {
  std::uint64_t groups = 0;                                 ///< solved by jfpx
  std::uint64_t on_device = 0;                              ///< of these: on the GPU
  std::uint64_t contacts = 0;                               ///< in these
  std::uint64_t joints = 0;                                 ///< constraints in these
  std::uint64_t sweeps = 0;                                 ///< over their rows
  std::array<std::uint64_t, kSolverFallbacks> fallbacks{};  ///< groups, by SolverFallback
  std::string device_failure;  ///< why the GPU was given up and x86 took over; empty: it was not
};

/// A btSequentialImpulseConstraintSolver that solves independent rows side by side, in vectors and
/// threads. Velocities, transforms, impulses, directions of friction and analytics are those of
/// btSequentialImpulseConstraintSolver, bit for bit: rows depend on each other only through bodies
/// that move, and each body meets its rows in Bullet's order.
///
/// Groups that it does not cover are solved by the base class; stats() says how often and why.
/// Programs that include Bullet's headers need -ffp-contract=off, which linking jfpx::bullet adds.
/// As in Bullet, one thread at a time; different solvers are independent.
class JFPX_API ConstraintSolver : public btSequentialImpulseConstraintSolver {
 public:
  BT_DECLARE_ALIGNED_ALLOCATOR();

  /// @throws InvalidArgument for more than 256 threads; BackendUnavailable if the backend is asked
  ///   for by name and can't be had; BuildMismatch (build.hpp).
  explicit ConstraintSolver(const ConstraintSolverOptions& options = {});
  /// For jfpx's own tests, which bring a device of their own: GroupSolver is not installed.
  /// options.backend says when it is used.
  ConstraintSolver(std::unique_ptr<GroupSolver> device, const ConstraintSolverOptions& options);
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
  void reset_stats();  ///< keeps `device_failure`: what failed stays given up

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
