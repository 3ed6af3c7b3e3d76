/// Builds a Bullet world from a scene.
#include <jfpx/bullet/dynamics_world.hpp>
#include <jfpx/bullet/scene_world.hpp>
#include <jfpx/error.hpp>

#include "src/bullet/world/timed_world.hpp"
#include "src/scene/compound.hpp"
#include "src/scene/inertia_tensor.hpp"
#include "src/scene/principal_inertia.hpp"
#include "src/world/bodies/integrate.hpp"
#include "src/world/bodies/motion_locks.hpp"

#include <BulletCollision/BroadphaseCollision/btDbvtBroadphase.h>
#include <BulletCollision/CollisionDispatch/btDefaultCollisionConfiguration.h>
#include <BulletCollision/CollisionShapes/btBoxShape.h>
#include <BulletCollision/CollisionShapes/btBvhTriangleMeshShape.h>
#include <BulletCollision/CollisionShapes/btCapsuleShape.h>
#include <BulletCollision/CollisionShapes/btCompoundShape.h>
#include <BulletCollision/CollisionShapes/btConeShape.h>
#include <BulletCollision/CollisionShapes/btConvexHullShape.h>
#include <BulletCollision/CollisionShapes/btCylinderShape.h>
#include <BulletCollision/CollisionShapes/btEmptyShape.h>
#include <BulletCollision/CollisionShapes/btHeightfieldTerrainShape.h>
#include <BulletCollision/CollisionShapes/btSphereShape.h>
#include <BulletCollision/CollisionShapes/btStaticPlaneShape.h>
#include <BulletCollision/CollisionShapes/btTriangleMesh.h>
#include <BulletDynamics/ConstraintSolver/btSequentialImpulseConstraintSolver.h>
#include <BulletDynamics/Dynamics/btRigidBody.h>

#include <algorithm>
#include <array>
#include <map>
#include <string>
#include <utility>

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {
namespace {

btVector3 to_bullet(const Vec3& v) { return {v.x, v.y, v.z}; }
btQuaternion to_bullet(const Quat& q) { return {q.x, q.y, q.z, q.w}; }
Vec3 from_bullet(const btVector3& v) { return {v.x(), v.y(), v.z()}; }
Quat from_bullet(const btQuaternion& q) { return {q.w(), q.x(), q.y(), q.z()}; }

bool is_half_space(const BodyDef& def) { return std::holds_alternative<HalfSpace>(def.shape); }

/// The axes of the Bullet body relative to those of the scene's body: Bullet requires principal
/// axes.
btTransform principal_axes(const PrincipalInertia& inertia) {
  const Mat3& m = inertia.axes;
  return btTransform(
      btMatrix3x3(m(0, 0), m(0, 1), m(0, 2), m(1, 0), m(1, 1), m(1, 2), m(2, 0), m(2, 1), m(2, 2)));
}

// The shape of Bullet for each kind of solid.
btCollisionShape* bullet_shape(const Sphere& sphere) { return new btSphereShape(sphere.radius); }
btCollisionShape* bullet_shape(const Box& box) {
  return new btBoxShape(to_bullet(box.half_extents));
}

btCollisionShape* bullet_shape(const Capsule& capsule) {
  return new btCapsuleShape(capsule.radius, 2 * capsule.half_height);
}
/// Bullet rounds the rims within its margin; a small one keeps them nearly sharp.
btCollisionShape* bullet_shape(const Cylinder& cylinder) {
  auto* shape = new btCylinderShape({cylinder.radius, cylinder.half_height, cylinder.radius});
  shape->setMargin(detail::least_half_width(cylinder) * btScalar(0.01));
  return shape;
}

/// Creates and owns shapes; if they are shared, equal shapes are created once.
class ShapeStore {
 public:
  explicit ShapeStore(bool share) : share_(share) {}

  /// @param axes of the Bullet body relative to the scene's; identity for all but compounds and
  ///   hulls
  btCollisionShape* get(const Shape& shape, const btTransform& axes) {
    return std::visit([&](const auto& s) { return make(s, axes); }, shape);
  }

 private:
  /// Kind of the shape, and its dimensions.
  using Key = std::array<Real, 5>;

  btCollisionShape* make(const HalfSpace& plane, const btTransform&) {
    shapes_.emplace_back(new btStaticPlaneShape(to_bullet(plane.normal), plane.offset));
    return shapes_.back().get();
  }
  /// Bullet's meshes are two-sided. Copies of a mesh share their data.
  btCollisionShape* make(const TriangleMesh& mesh, const btTransform&) {
    if (share_) {
      const auto found = shared_meshes_.find(mesh.data());
      if (found != shared_meshes_.end()) return found->second;
    }
    auto triangles = std::make_unique<btTriangleMesh>();
    triangles->preallocateVertices(static_cast<int>(mesh.vertices().size()));
    triangles->preallocateIndices(static_cast<int>(3 * mesh.triangles().size()));
    for (const Vec3& vertex : mesh.vertices()) {
      triangles->findOrAddVertex(to_bullet(vertex), false);
    }
    for (const auto& [a, b, c] : mesh.triangles()) {
      triangles->addTriangleIndices(static_cast<int>(a), static_cast<int>(b), static_cast<int>(c));
    }
    shapes_.emplace_back(new btBvhTriangleMeshShape(triangles.get(), true));
    triangles_.push_back(std::move(triangles));
    if (share_) shared_meshes_.emplace(mesh.data(), shapes_.back().get());
    return shapes_.back().get();
  }
  /// Bullet's heightfields are two-sided and have no holes, and the same diagonals. The range of
  /// the heights is symmetric, because Bullet moves its middle to the origin.
  btCollisionShape* make(const Heightfield& heightfield, const btTransform& axes) {
    const HeightfieldDef& def = heightfield.def();
    if (!def.holes.empty()) {
      const TriangleMesh mesh = to_triangle_mesh(heightfield);
      if (!mesh.triangles().empty()) return make(mesh, axes);
      // Bullet cannot build the tree of a mesh without triangles.
      shapes_.emplace_back(new btEmptyShape);
      return shapes_.back().get();
    }
    if (share_) {
      const auto found = shared_heightfields_.find(heightfield.data());
      if (found != shared_heightfields_.end()) return found->second;
    }
    const btScalar highest = heightfield.data()->half_extents.y;
    auto shape = std::make_unique<btHeightfieldTerrainShape>(
        static_cast<int>(def.columns), static_cast<int>(def.rows), def.heights.data(), -highest,
        highest, 1, false);
    shape->setLocalScaling({def.spacing_x, 1, def.spacing_z});
    heightfields_.push_back(heightfield);
    shapes_.push_back(std::move(shape));
    if (share_) shared_heightfields_.emplace(heightfield.data(), shapes_.back().get());
    return shapes_.back().get();
  }
  /// Unreachable, because require_bullet() rejects planes.
  btCollisionShape* make(const Plane&, const btTransform&) { return nullptr; }

  /// The points in the axes of the Bullet body. Bullet adds its margin to a hull; a small one keeps
  /// contacts where the hull is.
  btCollisionShape* make(const Hull& hull, const btTransform& axes) {
    auto shape = std::make_unique<btConvexHullShape>();
    for (const Vec3& vertex : hull.vertices()) {
      shape->addPoint(axes.inverse() * to_bullet(vertex), false);
    }
    shape->setMargin(hull.data().view.least_half_width * btScalar(0.01));
    shape->recalcLocalAabb();
    shapes_.push_back(std::move(shape));
    return shapes_.back().get();
  }
  /// Bullet's cone has its origin in the middle of the height, not in the centre of mass.
  btCollisionShape* make(const Cone& cone, const btTransform&) {
    auto child = std::make_unique<btConeShape>(cone.radius, 2 * cone.half_height);
    child->setMargin(detail::least_half_width(cone) * btScalar(0.01));
    auto shape = std::make_unique<btCompoundShape>();
    shape->addChildShape(
        btTransform(btQuaternion::getIdentity(), btVector3(0, cone.half_height / 2, 0)),
        child.get());
    shapes_.push_back(std::move(child));
    shapes_.push_back(std::move(shape));
    return shapes_.back().get();
  }
  btCollisionShape* make(const Compound& compound, const btTransform& axes) {
    auto shape = std::make_unique<btCompoundShape>();
    for (const CompoundPart& part : compound.parts) {
      const btTransform place(to_bullet(normalized(part.orientation)), to_bullet(part.position));
      const auto child = [&](const auto& solid) { return make(solid, btTransform::getIdentity()); };
      shape->addChildShape(axes.inverse() * place, std::visit(child, part.shape));
    }
    shapes_.push_back(std::move(shape));
    return shapes_.back().get();
  }

  template <class S>
  btCollisionShape* make(const S& solid, const btTransform&) {
    const detail::Solid record = detail::to_solid(solid);
    const Vec3& h = record.half_extents;
    return get(Key{static_cast<Real>(detail::kSolidKind<S>), h.x, h.y, h.z, record.radius},
               [&] { return bullet_shape(solid); });
  }

  template <class Make>
  btCollisionShape* get(const Key& key, Make make) {
    if (share_) {
      const auto found = shared_.find(key);
      if (found != shared_.end()) return found->second;
    }
    shapes_.emplace_back(make());
    if (share_) shared_.emplace(key, shapes_.back().get());
    return shapes_.back().get();
  }

  bool share_;
  std::vector<std::unique_ptr<btTriangleMesh>> triangles_;  ///< of the shapes
  std::vector<Heightfield> heightfields_;                   ///< whose heights the shapes use
  std::vector<std::unique_ptr<btCollisionShape>> shapes_;
  std::map<std::shared_ptr<const detail::MeshData>, btCollisionShape*> shared_meshes_;
  std::map<std::shared_ptr<const detail::HeightfieldData>, btCollisionShape*> shared_heightfields_;
  std::map<Key, btCollisionShape*> shared_;
};

/// Bullet multiplies the coefficients of two bodies; the product of square roots is the geometric
/// mean.
void require_bullet(const MaterialSettings& materials) {
  for (const auto& [field, rule] : {std::pair("friction", materials.friction),
                                    std::pair("restitution", materials.restitution)}) {
    if (rule == CombineRule::geometric_mean || rule == CombineRule::product) continue;
    throw InvalidScene(std::string("scene: materials.") + field + " is " + to_string(rule) +
                       "; it must be geometric_mean or product, because Bullet multiplies the "
                       "coefficients of two bodies");
  }
}

/// Whether the shape can be rotated to its principal axes in Bullet, which stores moments of
/// inertia about the axes of the shape.
bool has_own_axes(const Shape& shape) {
  return std::holds_alternative<Compound>(shape) || std::holds_alternative<Hull>(shape);
}

/// Bullet has no two-sided plane, and no products of inertia.
void require_bullet(const BodyDef& def, std::size_t body) {
  const auto refuse = [body](const char* what) {
    throw InvalidScene("body " + std::to_string(body) + ": " + what);
  };
  if (std::holds_alternative<Plane>(def.shape)) {
    refuse(
        "shape is a two-sided plane, which Bullet does not support; it must be a half-space or a "
        "box to run in Bullet");
  }
  if (has_own_axes(def.shape)) return;
  if (def.mass > 0 && def.inertia && !is_diagonal(*def.inertia)) {
    refuse("inertia has products of inertia; it must be diagonal to run in Bullet");
  }
}

/// The principal inertia of a movable compound or hull; the default for all other bodies.
PrincipalInertia inertia_of(const BodyDef& def) {
  if (!has_own_axes(def.shape) || !(def.mass > 0)) return {};
  return principal_inertia(def.inertia ? symmetric_part(*def.inertia)
                                       : solid_inertia(def.shape, def.mass));
}

/// The moments of inertia of a solid. Bullet's moments are exact for spheres and boxes; for other
/// shapes they are those of an enclosing box.
btVector3 inertia_of(const BodyDef& def, const btCollisionShape* shape) {
  if (std::holds_alternative<Sphere>(def.shape) || std::holds_alternative<Box>(def.shape)) {
    btVector3 inertia(0, 0, 0);
    shape->calculateLocalInertia(def.mass, inertia);
    return inertia;
  }
  const Mat3 inertia = solid_inertia(def.shape, def.mass);
  return {inertia(0, 0), inertia(1, 1), inertia(2, 2)};
}

Real factor(CombineRule rule, Real coefficient) {
  return rule == CombineRule::product ? coefficient : square_root(coefficient);
}

/// Locks axes of motion, and ends the motion along and about them.
void lock_motion(btRigidBody* body, const MotionLocks& locks) {
  body->setLinearFactor(to_bullet(detail::free_linear(locks, {1, 1, 1})));
  body->setAngularFactor(to_bullet(detail::free_angular(locks, {1, 1, 1})));
  body->setLinearVelocity(body->getLinearVelocity() * body->getLinearFactor());
  body->setAngularVelocity(body->getAngularVelocity() * body->getAngularFactor());
}

std::unique_ptr<btRigidBody> make_body(const BodyDef& def, const PrincipalInertia& own,
                                       const MaterialSettings& materials, btCollisionShape* shape,
                                       bool can_sleep) {
  const Real mass = is_half_space(def) ? 0 : def.mass;
  const bool compound = has_own_axes(def.shape);
  btVector3 inertia(0, 0, 0);
  if (compound) inertia = to_bullet(own.moments);
  if (mass > 0 && !compound) inertia = inertia_of(def, shape);
  if (mass > 0 && !compound && def.inertia) {
    inertia = {(*def.inertia)(0, 0), (*def.inertia)(1, 1), (*def.inertia)(2, 2)};
  }
  btRigidBody::btRigidBodyConstructionInfo info(mass, nullptr, shape, inertia);
  if (!is_half_space(def)) {
    info.m_startWorldTransform = btTransform(to_bullet(def.orientation), to_bullet(def.position));
  }
  if (compound) info.m_startWorldTransform *= principal_axes(own);
  info.m_linearDamping = 1 - def.linear_damping;
  info.m_angularDamping = 1 - def.angular_damping;
  info.m_friction = factor(materials.friction, def.friction);
  info.m_restitution = factor(materials.restitution, def.restitution);
  auto body = std::make_unique<btRigidBody>(info);
  body->setFlags(body->getFlags() | BT_DISABLE_WORLD_GRAVITY);
  if (def.kinematic) {
    body->setCollisionFlags(body->getCollisionFlags() | btCollisionObject::CF_KINEMATIC_OBJECT);
    body->setActivationState(DISABLE_DEACTIVATION);
  }
  if (def.sensor) {
    body->setCollisionFlags(body->getCollisionFlags() | btCollisionObject::CF_NO_CONTACT_RESPONSE);
  }
  if (mass > 0) body->setGravity(to_bullet(def.acceleration));
  if (mass > 0 || def.kinematic) {
    body->setLinearVelocity(to_bullet(def.velocity));
    body->setAngularVelocity(to_bullet(def.angular_velocity));
  }
  if (mass > 0 && def.motion_locks != MotionLocks{}) lock_motion(body.get(), def.motion_locks);
  if (mass > 0 && !can_sleep) {
    body->setActivationState(DISABLE_DEACTIVATION);
  }
  return body;
}

std::unique_ptr<btSequentialImpulseConstraintSolver> make_solver(const SceneWorldOptions& options) {
  if (options.solver == SolverKind::stock) {
    return std::make_unique<btSequentialImpulseConstraintSolver>();
  }
  return std::make_unique<ConstraintSolver>(options.solve);
}

std::unique_ptr<btDiscreteDynamicsWorld> make_world(btCollisionDispatcher* dispatcher,
                                                    btBroadphaseInterface* broadphase,
                                                    btConstraintSolver* solver,
                                                    btCollisionConfiguration* configuration,
                                                    const SceneWorldOptions& options,
                                                    StageTimes* times) {
  if (options.world == WorldKind::stock) {
    return std::make_unique<TimedWorld<btDiscreteDynamicsWorld>>(times, dispatcher, broadphase,
                                                                 solver, configuration);
  }
  return std::make_unique<TimedWorld<DynamicsWorld>>(times, dispatcher, broadphase, solver,
                                                     configuration, options.step);
}

}  // namespace

/// Members are in the order of construction that Bullet requires, and are destroyed in reverse
/// order.
struct SceneWorld::Impl {
  Scene scene;
  ShapeStore shapes;
  btDefaultCollisionConfiguration configuration;
  std::unique_ptr<btCollisionDispatcher> dispatcher;
  btDbvtBroadphase broadphase;
  std::unique_ptr<btSequentialImpulseConstraintSolver> solver;
  std::vector<std::unique_ptr<btRigidBody>> owned;
  std::vector<btRigidBody*> bodies;
  std::vector<PrincipalInertia> inertia;  ///< by body; the default for all but movable compounds
  StageTimes times;
  std::unique_ptr<btDiscreteDynamicsWorld> world;

  Impl(bool caller_is_fused, Scene source, const SceneWorldOptions& options)
      : scene(std::move(source)),
        shapes(options.share_shapes),
        dispatcher(make_dispatcher(caller_is_fused, &configuration, options)),
        solver(make_solver(options)),
        world(make_world(dispatcher.get(), &broadphase, solver.get(), &configuration, options,
                         &times)) {
    world->setGravity({0, 0, 0});
    world->getDispatchInfo().m_deterministicOverlappingPairs = options.deterministic_pairs;
    const bool filtered = std::ranges::any_of(
        scene.bodies, [](const BodyDef& def) { return def.filter != CollisionFilter{}; });
    for (const BodyDef& def : scene.bodies) {
      require_bullet(def, bodies.size());
      inertia.push_back(inertia_of(def));
      const bool can_sleep = scene.sleep.enabled && def.can_sleep;
      btCollisionShape* shape = shapes.get(def.shape, principal_axes(inertia.back()));
      owned.push_back(make_body(def, inertia.back(), scene.materials, shape, can_sleep));
      bodies.push_back(owned.back().get());
      add_to_world(bodies.back(), def.filter, filtered);
    }
    for (const BodyPair& pair : scene.ignored_pairs) {
      bodies[pair.a]->setIgnoreCollisionCheck(bodies[pair.b], true);
      bodies[pair.b]->setIgnoreCollisionCheck(bodies[pair.a], true);
    }
  }
  static std::unique_ptr<btCollisionDispatcher> make_dispatcher(
      bool caller_is_fused, btCollisionConfiguration* configuration,
      const SceneWorldOptions& options) {
    if (options.dispatcher == DispatcherKind::stock) {
      return std::make_unique<btCollisionDispatcher>(configuration);
    }
    std::unique_ptr<SphereCollider> collider =
        options.make_collider ? options.make_collider()
                              : make_sphere_collider(options.dispatch.collider);
    return std::unique_ptr<btCollisionDispatcher>(
        new CollisionDispatcher(CollisionDispatcher::CallerIsFused{caller_is_fused}, configuration,
                                std::move(collider), options.dispatch));
  }
  /// Without filters, Bullet's defaults also exclude the pairs of two bodies of mass 0.
  void add_to_world(btRigidBody* body, const CollisionFilter& filter, bool filtered) {
    if (!filtered) return world->addRigidBody(body);
    world->addRigidBody(body, static_cast<int>(filter.category), static_cast<int>(filter.mask));
  }
  /// Moves kinematic bodies like the native engine; Bullet derives velocities from the displacement
  /// since the interpolated pose. That of a conveyor is set back by its motion along and about
  /// locked axes.
  void move_kinematic_bodies(Real dt) {
    for (std::size_t i = 0; i < bodies.size(); ++i) {
      const BodyDef& def = scene.bodies[i];
      if (!def.kinematic) continue;
      const btTransform pose = bodies[i]->getWorldTransform();
      const auto moved = [&](const Vec3& velocity, const Vec3& angular_velocity) {
        const btVector3 origin = pose.getOrigin() + to_bullet(velocity * dt);
        // Conversions of the rotation would add their rounding errors in each step.
        if (angular_velocity == Vec3{}) return btTransform(pose.getBasis(), origin);
        return btTransform(to_bullet(detail::integrated_orientation(from_bullet(pose.getRotation()),
                                                                    angular_velocity, dt)),
                           origin);
      };
      const Vec3 free = detail::free_linear(def.motion_locks, def.velocity);
      const Vec3 turning = detail::free_angular(def.motion_locks, def.angular_velocity);
      bodies[i]->setWorldTransform(moved(free, turning));
      if (def.motion_locks == MotionLocks{}) continue;
      bodies[i]->setInterpolationWorldTransform(
          moved(free - def.velocity, turning - def.angular_velocity));
    }
  }
  ~Impl() {
    // For every removed body, Bullet scans all pairs of the world. Removing the pairs first avoids
    // the scans.
    btOverlappingPairCache* cache = broadphase.getOverlappingPairCache();
    while (cache->getNumOverlappingPairs() > 0) {
      const btBroadphasePair& last =
          cache->getOverlappingPairArrayPtr()[cache->getNumOverlappingPairs() - 1];
      cache->removeOverlappingPair(last.m_pProxy0, last.m_pProxy1, dispatcher.get());
    }
  }
};

SceneWorld::SceneWorld(bool caller_is_fused, const Scene& scene, const SceneWorldOptions& options) {
  validate(scene);
  require_bullet(scene.materials);
  if (!scene.joints.empty()) {
    throw InvalidScene("scene: joints has " + std::to_string(scene.joints.size()) +
                       " joints, which SceneWorld does not support; it must be empty to run in "
                       "Bullet");
  }
  impl_ = std::make_unique<Impl>(caller_is_fused, scene, options);
}
SceneWorld::~SceneWorld() = default;
SceneWorld::SceneWorld(SceneWorld&&) noexcept = default;
SceneWorld& SceneWorld::operator=(SceneWorld&&) noexcept = default;

void SceneWorld::step(Real dt) {
  if (!(dt > kEpsilon) || !is_finite(dt)) {
    throw InvalidArgument("dt is " + std::to_string(dt) +
                          " s; it must be finite and larger than the machine epsilon");
  }
  impl_->move_kinematic_bodies(dt);
  // Without substeps, Bullet performs one step of the full length and keeps no remainder.
  impl_->world->stepSimulation(dt, 0, dt);
}
void SceneWorld::step() { step(impl_->scene.dt); }

std::vector<BodyState> SceneWorld::states() const {
  std::vector<BodyState> states;
  states.reserve(impl_->bodies.size());
  for (std::size_t i = 0; i < impl_->bodies.size(); ++i) {
    const btRigidBody& body = *impl_->bodies[i];
    const BodyDef& def = impl_->scene.bodies[i];
    if (is_half_space(def)) {
      states.push_back({def.position, def.orientation, {}, {}});
      continue;
    }
    btTransform pose = body.getWorldTransform();
    if (impl_->inertia[i].axes != Mat3{}) pose *= principal_axes(impl_->inertia[i]).inverse();
    states.push_back({from_bullet(pose.getOrigin()), from_bullet(pose.getRotation()),
                      from_bullet(body.getLinearVelocity()),
                      from_bullet(body.getAngularVelocity())});
  }
  return states;
}
std::uint64_t SceneWorld::state_hash() const { return jfpx::state_hash(states()); }
const StageTimes& SceneWorld::last_step() const noexcept { return impl_->times; }

const Scene& SceneWorld::scene() const noexcept { return impl_->scene; }
btDiscreteDynamicsWorld& SceneWorld::world() noexcept { return *impl_->world; }
const btDiscreteDynamicsWorld& SceneWorld::world() const noexcept { return *impl_->world; }
btCollisionDispatcher& SceneWorld::dispatcher() noexcept { return *impl_->dispatcher; }
CollisionDispatcher* SceneWorld::jfpx_dispatcher() noexcept {
  return dynamic_cast<CollisionDispatcher*>(impl_->dispatcher.get());
}
const CollisionDispatcher* SceneWorld::jfpx_dispatcher() const noexcept {
  return dynamic_cast<const CollisionDispatcher*>(impl_->dispatcher.get());
}
const ConstraintSolver* SceneWorld::jfpx_solver() const noexcept {
  return dynamic_cast<const ConstraintSolver*>(impl_->solver.get());
}
std::span<btRigidBody* const> SceneWorld::bodies() const noexcept { return impl_->bodies; }

}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
