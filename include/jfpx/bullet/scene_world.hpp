/// A complete Bullet world built from a jfpx::Scene.
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
  /// Creates the dispatcher's collider, if set; of dispatch.collider, only `threads` is then used.
  std::function<std::unique_ptr<SphereCollider>()> make_collider = {};
  SolverKind solver = SolverKind::jfpx;
  ConstraintSolverOptions solve = {};  ///< for SolverKind::jfpx
  WorldKind world = WorldKind::jfpx;
  DynamicsWorldOptions step = {};    ///< for WorldKind::jfpx
  bool share_shapes = true;          ///< one btSphereShape per radius, one btBoxShape per size
  bool deterministic_pairs = false;  ///< btDispatcherInfo::m_deterministicOverlappingPairs
};

/// Wall-clock times of the stages of one step [ms].
struct StageTimes {
  double integrate = 0;   ///< prediction, integration, activation
  double broadphase = 0;  ///< AABBs and overlapping pairs
  double dispatch = 0;    ///< dispatchAllCollisionPairs
  double islands = 0;     ///< calculateSimulationIslands
  double solve = 0;       ///< solveConstraints, including the construction of islands
  double total = 0;
};

/// Owns a btDiscreteDynamicsWorld built from a scene, with Bullet's default configuration and
/// dynamic tree broadphase. The bodies of the scene are mapped to Bullet as follows:
/// - mass 0: a static body;
/// - half-space: a static plane, which ignores the body's pose (Bullet has no two-sided plane);
/// - compound: a btCompoundShape in its principal axes, with the inertia of the native engine;
/// - kinematic body: a kinematic body of Bullet, moved by its velocities before each step;
/// - given inertia: must be diagonal except for compounds, because Bullet stores moments about the
///   axes of the shape;
/// - damping: Bullet's value is the fraction of velocity *lost* per second, with the same law of
///   decay;
/// - friction and restitution: Bullet multiplies the values of two bodies, so they are unchanged
///   where the scene's rule is the product and are square roots where it is the geometric mean;
/// - acceleration: the gravity of the body; the gravity of the world is zero;
/// - filters: the collision filter groups and masks of Bullet, if any filter is not the default. A
///   kinematic body then also gets contact points with other bodies of mass 0; these points have no
///   effect;
/// - motion locks: setLinearFactor() and setAngularFactor();
/// - sensor: CF_NO_CONTACT_RESPONSE;
/// - ignored pairs: btCollisionObject::setIgnoreCollisionCheck();
/// - a body that must not sleep, and every body of a scene without sleep: DISABLE_DEACTIVATION.
///   Bullet's sleep thresholds keep their defaults, because Bullet measures motion differently.
///
/// Not thread-safe; different worlds may be used by different threads.
class JFPX_BULLET_API SceneWorld {
 public:
  /// @throws InvalidScene, also for joints, and for features that Bullet lacks: a two-sided plane,
  ///   an inertia that is not diagonal, a combine rule of friction or restitution other than
  ///   geometric mean and product; any exception of the constructor of CollisionDispatcher.
  [[gnu::always_inline]] explicit SceneWorld(const Scene& scene,
                                             const SceneWorldOptions& options = {})
      : SceneWorld(fuses_products(), scene, options) {}
  ~SceneWorld();
  SceneWorld(SceneWorld&&) noexcept;
  SceneWorld& operator=(SceneWorld&&) noexcept;

  /// Runs exactly one internal step of Bullet. dt: its length [s], larger than the machine epsilon.
  /// @throws InvalidArgument for any other dt.
  void step(Real dt);
  void step();  ///< one step of the scene's dt

  /// States in the order of the scene's bodies; orientations are converted from the transforms.
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
  /// The Bullet bodies, in the order of the scene's bodies.
  std::span<btRigidBody* const> bodies() const noexcept;

 private:
  struct Impl;

  SceneWorld(bool caller_is_fused, const Scene& scene, const SceneWorldOptions& options);

  std::unique_ptr<Impl> impl_;
};

}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
