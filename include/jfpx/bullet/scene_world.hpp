/// A jfpx::Scene as a complete Bullet world that steps by itself.
#pragma once

#include <jfpx/bullet/constraint_solver.hpp>
#include <jfpx/bullet/dispatcher.hpp>
#include <jfpx/bullet/dynamics_world.hpp>
#include <jfpx/scene.hpp>

#include <functional>
#include <memory>
#include <span>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {

enum class DispatcherKind : std::uint8_t { stock, jfpx };
enum class SolverKind : std::uint8_t { stock, jfpx };
enum class WorldKind : std::uint8_t { stock, jfpx };

struct SceneWorldOptions {
  DispatcherKind dispatcher = DispatcherKind::jfpx;
  DispatcherOptions dispatch = {};  ///< for DispatcherKind::jfpx
  /// Makes the dispatcher's collider, if set: of dispatch.collider only `threads` counts then.
  std::function<std::unique_ptr<SphereCollider>()> make_collider = {};
  SolverKind solver = SolverKind::jfpx;
  ConstraintSolverOptions solve = {};  ///< for SolverKind::jfpx
  WorldKind world = WorldKind::jfpx;
  DynamicsWorldOptions step = {};    ///< for WorldKind::jfpx
  bool share_shapes = true;          ///< one btSphereShape a radius, one btBoxShape a size
  bool deterministic_pairs = false;  ///< btDispatcherInfo::m_deterministicOverlappingPairs
};

/// Wall clock of the stages of one step: [ms].
struct StageTimes {
  double integrate = 0;   ///< prediction, integration, activation
  double broadphase = 0;  ///< boxes and overlapping pairs
  double dispatch = 0;    ///< dispatchAllCollisionPairs
  double islands = 0;     ///< calculateSimulationIslands
  double solve = 0;       ///< solveConstraints, with the splitting into islands
  double total = 0;
};

/// Owns a btDiscreteDynamicsWorld made from a scene, with Bullet's default configuration and
/// dynamic tree broadphase. What a body of the scene becomes:
/// - mass 0 is a static body; a half-space is a static plane and follows no pose; Bullet has no
///   two-sided plane;
/// - an compound is a btCompoundShape in its principal axes, with the inertia of the native engine;
/// - a kinematic body is one of Bullet's, moved by its velocities before each step;
/// - a given inertia, but for an compound, must be diagonal, for Bullet keeps moments about the
///   axes of the shape;
/// - damping: Bullet's is the share of velocity *lost* per second, with the same law of decay;
/// - friction and restitution: Bullet multiplies the values of two bodies, so they stay as they are
///   where the scene's rule is the product and become square roots where it is the geometric mean;
/// - acceleration: the body's own gravity; the world has none;
/// - a body that may not sleep, and every body of a scene without sleep: DISABLE_DEACTIVATION.
///   Bullet's sleep thresholds stay at its defaults: it measures motion in its own way.
/// Not thread-safe; several worlds in several threads are.
class JFPX_API SceneWorld {
 public:
  /// @throws InvalidScene, also for what Bullet can't follow: a two-sided plane, an inertia that is
  ///   not diagonal, friction and restitution that combine by another rule than geometric mean or
  ///   product; what the constructor of CollisionDispatcher throws.
  explicit SceneWorld(const Scene& scene, const SceneWorldOptions& options = {});
  ~SceneWorld();
  SceneWorld(SceneWorld&&) noexcept;
  SceneWorld& operator=(SceneWorld&&) noexcept;

  /// Exactly one internal step of Bullet, of length dt: [s], larger than the machine epsilon.
  /// @throws InvalidArgument for any other dt.
  void step(Real dt);
  void step();  ///< one step of the scene's dt

  /// States in the order of the scene's bodies; orientations from the basis of the transforms.
  std::vector<BodyState> states() const;
  std::uint64_t state_hash() const;  ///< jfpx::state_hash() of states()
  const StageTimes& last_step() const noexcept;

  const Scene& scene() const noexcept;
  btDiscreteDynamicsWorld& world() noexcept;
  const btDiscreteDynamicsWorld& world() const noexcept;
  btCollisionDispatcher& dispatcher() noexcept;
  /// Null for DispatcherKind::stock.
  CollisionDispatcher* jfpx_dispatcher() noexcept;
  const CollisionDispatcher* jfpx_dispatcher() const noexcept;
  /// Null for SolverKind::stock.
  const ConstraintSolver* jfpx_solver() const noexcept;
  /// The Bullet bodies, in the order of the scene's.
  std::span<btRigidBody* const> bodies() const noexcept;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
