/// The bodies, joints and events of a running random world.
#include "tests/bullet/live_random_world.hpp"

#include "tests/bullet/random_world_globals.hpp"

#include <BulletCollision/BroadphaseCollision/btAxisSweep3.h>
#include <BulletCollision/BroadphaseCollision/btSimpleBroadphase.h>
#include <BulletCollision/CollisionDispatch/btSimulationIslandManager.h>
#include <BulletCollision/CollisionShapes/btCompoundShape.h>
#include <BulletCollision/CollisionShapes/btHeightfieldTerrainShape.h>

#include <cmath>

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {
namespace {

btVector3 to_bullet(const Vec3& v) { return {v.x, v.y, v.z}; }

}  // namespace

LiveWorld::LiveWorld(const RandomWorld& world, MakeDispatcher make_dispatcher,
                     const WorldParts& parts)
    : random_(world),
      live_(
          make_configuration(),
          [&](btCollisionConfiguration* c) { return make_dispatcher(c, random_); },
          make_broadphase(), parts) {
  g_current = &live_;
  live_.world.setGravity(to_bullet(random_.gravity));
  live_.world.getDispatchInfo().m_deterministicOverlappingPairs = random_.deterministic;
  live_.world.getSimulationIslandManager()->setSplitIslands(random_.split_islands);
  for (std::size_t i = 0; i < random_.bodies.size(); ++i) add_body(i);
  for (const RandomJoint& joint : random_.joints) add_joint(joint);
}

LiveWorld::~LiveWorld() {
  g_current = &live_;
  while (live_.world.getNumConstraints() > 0) remove_joint(live_.world.getConstraint(0));
  for (btRigidBody* body : bodies_) {
    if (body != nullptr && body->isInWorld()) live_.world.removeRigidBody(body);
  }
  g_current = nullptr;
}

void LiveWorld::set_near_callback(bool on) {
  live_.dispatcher->setNearCallback(on ? logging_near_callback
                                       : btCollisionDispatcher::defaultNearCallback);
}

void LiveWorld::step() {
  for (std::size_t i = 0; i < bodies_.size(); ++i) {
    if (bodies_[i] == nullptr || (random_.bodies[i].traits & kKinematic) == 0) continue;
    btTransform pose = bodies_[i]->getWorldTransform();
    pose.setOrigin(pose.getOrigin() + to_bullet(random_.bodies[i].velocity) * random_.dt);
    bodies_[i]->setWorldTransform(pose);
  }
  const btScalar fixed = random_.sub_steps > 0 ? random_.dt / 2 : random_.dt;
  live_.world.stepSimulation(random_.dt, random_.sub_steps, fixed);
}

std::unique_ptr<btCollisionConfiguration> LiveWorld::make_configuration() const {
  btDefaultCollisionConstructionInfo info;
  info.m_defaultMaxPersistentManifoldPoolSize = random_.pool;
  info.m_defaultMaxCollisionAlgorithmPoolSize = random_.pool;
  return std::make_unique<btDefaultCollisionConfiguration>(info);
}

std::unique_ptr<btBroadphaseInterface> LiveWorld::make_broadphase() {
  const btScalar far = 1000 * random_.scale;
  switch (random_.broadphase) {
    case BroadphaseKind::tree:
      break;
    case BroadphaseKind::simple:
      return std::make_unique<btSimpleBroadphase>(1000);
    case BroadphaseKind::sweep:
      return std::make_unique<bt32BitAxisSweep3>(btVector3(-far, -far, -far),
                                                 btVector3(far, far, far), 1000u);
    case BroadphaseKind::sorted_pairs:
      return std::make_unique<btSimpleBroadphase>(1000, &sorted_pairs_);
  }
  return std::make_unique<btDbvtBroadphase>();
}

btCollisionShape* LiveWorld::make_shape(const RandomBody& body) {
  const btScalar s = body.size;
  switch (body.shape) {
    case ShapeKind::sphere:
      break;
    case ShapeKind::box:
      return live_.keep(new btBoxShape(btVector3(s, s, s)));
    case ShapeKind::plane:
      return live_.keep(new btStaticPlaneShape(
          btVector3(body.normal.x, body.normal.y, body.normal.z), body.offset));
    case ShapeKind::capsule:
      return live_.keep(new btCapsuleShape(s / 2, s));
    case ShapeKind::compound: {
      auto* compound = new btCompoundShape();
      live_.keep(compound);
      btTransform at = btTransform::getIdentity();
      // The trait of spheres means for a compound that it has one child.
      const int last = (body.traits & kSharesShape) != 0 ? -1 : 1;
      for (int k = -1; k <= last; ++k) {
        at.setOrigin(btVector3(btScalar(k) * s, 0, 0));
        compound->addChildShape(at, live_.keep(new btSphereShape(s / 2)));
      }
      return compound;
    }
    case ShapeKind::mesh:
    case ShapeKind::heights:
      return live_.keep(make_terrain(body));
  }
  if ((body.traits & kSharesShape) != 0) {
    for (auto& [size, shape] : shared_spheres_) {
      if (size == s) return shape;
    }
    shared_spheres_.emplace_back(s, live_.keep(new btSphereShape(s)));
    return shared_spheres_.back().second;
  }
  return live_.keep(new btSphereShape(s));
}

btCollisionShape* LiveWorld::make_terrain(const RandomBody& body) {
  constexpr int kPoints = 9;
  const btScalar cell = body.size;
  const auto height = [&](int i) { return cell * btScalar(i * 37 % 11) / 20; };
  if (body.shape == ShapeKind::heights) {
    for (int i = 0; i < kPoints * kPoints; ++i) terrain_.points.push_back(height(i));
    auto* heights =
        new btHeightfieldTerrainShape(kPoints, kPoints, terrain_.points.data(), 1, 0, cell, 1,
                                      sizeof(btScalar) == 8 ? PHY_DOUBLE : PHY_FLOAT, false);
    heights->setLocalScaling(btVector3(cell, 1, cell));
    return heights;
  }
  for (int i = 0; i < kPoints * kPoints; ++i) {
    terrain_.points.insert(terrain_.points.end(),
                           {cell * btScalar(i % kPoints - kPoints / 2), height(i) - cell / 4,
                            cell * btScalar(i / kPoints - kPoints / 2)});
  }
  for (int row = 0; row + 1 < kPoints; ++row) {
    for (int column = 0; column + 1 < kPoints; ++column) {
      const int a = row * kPoints + column;
      terrain_.indices.insert(terrain_.indices.end(),
                              {a, a + kPoints, a + 1, a + 1, a + kPoints, a + kPoints + 1});
    }
  }
  btIndexedMesh part;
  part.m_numTriangles = static_cast<int>(terrain_.indices.size()) / 3;
  part.m_triangleIndexBase = reinterpret_cast<const unsigned char*>(terrain_.indices.data());
  part.m_triangleIndexStride = 3 * sizeof(int);
  part.m_numVertices = kPoints * kPoints;
  part.m_vertexBase = reinterpret_cast<const unsigned char*>(terrain_.points.data());
  part.m_vertexStride = 3 * sizeof(btScalar);
  terrain_.arrays.addIndexedMesh(part);
  const btVector3 far(10 * cell, 10 * cell, 10 * cell);
  return new btBvhTriangleMeshShape(&terrain_.arrays, true, -far, far);
}

void LiveWorld::deform(const RandomEvent& event) {
  btRigidBody* body = bodies_[event.a];
  const RandomBody& random = random_.bodies[event.a];
  for (std::size_t k = 0; k < 8; ++k) {
    const std::size_t point = (event.bits + 13 * k) % 81;
    const btScalar height = random.size * btScalar(0.4) * event.x * btScalar(k % 2);
    terrain_.points[random.shape == ShapeKind::mesh ? 3 * point + 1 : point] = height;
  }
  if (random.shape != ShapeKind::mesh) return;
  const btScalar far = 10 * random.size;
  static_cast<btBvhTriangleMeshShape*>(body->getCollisionShape())
      ->refitTree(btVector3(-far, -far, -far), btVector3(far, far, far));
}

void LiveWorld::add_body(std::size_t i) {
  const RandomBody& body = random_.bodies[i];
  bodies_.push_back(nullptr);
  other_shapes_.push_back(nullptr);
  if (!body.used) return;
  btCollisionShape* shape = make_shape(body);
  const btScalar mass = (body.traits & kKinematic) != 0 ? btScalar(0) : body.mass;
  btVector3 inertia(0, 0, 0);
  if (mass > 0) shape->calculateLocalInertia(mass, inertia);
  live_.bodies.push_back(std::make_unique<btRigidBody>(mass, nullptr, shape, inertia));
  btRigidBody* made = live_.bodies.back().get();
  bodies_[i] = made;
  made->setUserIndex(static_cast<int>(i));
  place(made, to_bullet(body.position));
  made->setLinearVelocity(to_bullet(body.velocity));
  made->setAngularVelocity(to_bullet(body.spin));
  made->setFriction(body.friction);
  made->setRestitution(body.restitution);
  made->setRollingFriction(body.rolling);
  made->setSpinningFriction(-body.rolling);
  apply_traits(made, body);
  if ((body.traits & kLateComer) == 0) enter(i);
}

void LiveWorld::apply_traits(btRigidBody* made, const RandomBody& body) {
  int flags = made->getCollisionFlags();
  if ((body.traits & kKinematic) != 0) flags |= btCollisionObject::CF_KINEMATIC_OBJECT;
  if ((body.traits & kSensor) != 0) flags |= btCollisionObject::CF_NO_CONTACT_RESPONSE;
  if ((body.traits & kCustomMaterial) != 0) {
    flags |= btCollisionObject::CF_CUSTOM_MATERIAL_CALLBACK;
  }
  if ((body.traits & kFrictionAnchor) != 0) flags |= btCollisionObject::CF_HAS_FRICTION_ANCHOR;
  made->setCollisionFlags(flags);
  if ((body.traits & kSoftContact) != 0) made->setContactStiffnessAndDamping(1000, 1);
  if ((body.traits & kContinuous) != 0) {
    made->setCcdMotionThreshold(body.size / 8);
    made->setCcdSweptSphereRadius(body.size / 2);
  }
  if ((body.traits & kNoSleep) != 0) made->setActivationState(DISABLE_DEACTIVATION);
  if ((body.traits & kSleepy) != 0) made->setSleepingThresholds(1000 * body.size, 1000);
  if ((body.traits & kAnisotropic) != 0) {
    made->setAnisotropicFriction(btVector3(1, btScalar(0.5), btScalar(0.2)),
                                 btCollisionObject::CF_ANISOTROPIC_FRICTION |
                                     btCollisionObject::CF_ANISOTROPIC_ROLLING_FRICTION);
  }
  if ((body.traits & kMargin) != 0) {
    made->getCollisionShape()->setMargin(body.size / 16);
    made->setContactProcessingThreshold(body.size / 32);
  }
}

void LiveWorld::place(btRigidBody* body, const btVector3& position) {
  btTransform pose = body->getWorldTransform();
  pose.setOrigin(position);
  body->setWorldTransform(pose);
  body->setInterpolationWorldTransform(pose);
}

void LiveWorld::enter(std::size_t i) {
  btRigidBody* body = bodies_[i];
  const btTransform& pose = body->getWorldTransform();
  if (!std::isfinite(pose.getOrigin().length2()) || !std::isfinite(pose.getBasis()[0].x()) ||
      !std::isfinite(body->getLinearVelocity().length2())) {
    body->setWorldTransform(btTransform::getIdentity());
    place(body, to_bullet(random_.bodies[i].position));
    body->setLinearVelocity(btVector3(0, 0, 0));
    body->setAngularVelocity(btVector3(0, 0, 0));
  }
  if (random_.bodies[i].group != 0) {
    live_.world.addRigidBody(body, random_.bodies[i].group, random_.bodies[i].mask);
  } else {
    live_.world.addRigidBody(body);
  }
}

void LiveWorld::add_joint(const RandomJoint& joint) {
  btRigidBody *a = bodies_[joint.a], *b = bodies_[joint.b];
  if (a == nullptr || b == nullptr || !a->isInWorld() || !b->isInWorld()) return;
  if (a->getInvMass() == 0 && b->getInvMass() == 0) return;
  const btVector3 middle =
      (a->getWorldTransform().getOrigin() + b->getWorldTransform().getOrigin()) / 2;
  joints_.push_back(std::make_unique<btPoint2PointConstraint>(
      *a, *b, a->getWorldTransform().invXform(middle), b->getWorldTransform().invXform(middle)));
  joints_.back()->setBreakingImpulseThreshold(joint.breaking);
  live_.world.addConstraint(joints_.back().get(), !joint.collide);
}

void LiveWorld::remove_joint(btTypedConstraint* joint) {
  live_.world.removeConstraint(joint);
  std::erase_if(joints_, [&](const auto& owned) { return owned.get() == joint; });
}

void LiveWorld::leave(btRigidBody* body) {
  for (int i = live_.world.getNumConstraints() - 1; i >= 0; --i) {
    btTypedConstraint* joint = live_.world.getConstraint(i);
    if (&joint->getRigidBodyA() == body || &joint->getRigidBodyB() == body) remove_joint(joint);
  }
  live_.world.removeRigidBody(body);
}

void LiveWorld::reshape(std::size_t i) {
  btRigidBody* body = bodies_[i];
  const ShapeKind kind = random_.bodies[i].shape;
  if (kind == ShapeKind::plane || kind == ShapeKind::mesh || kind == ShapeKind::heights) return;
  // As Bullet requires, the pairs are cleaned when the type of a shape changes.
  if (body->isInWorld()) {
    live_.world.getPairCache()->cleanProxyFromPairs(body->getBroadphaseHandle(),
                                                    live_.dispatcher.get());
  }
  if (other_shapes_[i] == nullptr) {
    const btScalar half = random_.bodies[i].size / 2;
    other_shapes_[i] = live_.keep(new btBoxShape(btVector3(half, half, half)));
  }
  btCollisionShape* now = body->getCollisionShape();
  body->setCollisionShape(other_shapes_[i]);
  other_shapes_[i] = now;
}

void LiveWorld::apply(const RandomEvent& event) {
  btRigidBody *a = bodies_[event.a], *b = bodies_[event.b];
  btDispatcherInfo& info = live_.world.getDispatchInfo();
  switch (event.kind) {
    case EventKind::gravity:
      live_.world.setGravity(to_bullet(event.v));
      return;
    case EventKind::dispatch:
      live_.dispatcher->dispatchAllCollisionPairs(live_.world.getPairCache(), info,
                                                  live_.dispatcher.get());
      return;
    case EventKind::continuous:
      info.m_dispatchFunc = info.m_dispatchFunc == btDispatcherInfo::DISPATCH_DISCRETE
                                ? btDispatcherInfo::DISPATCH_CONTINUOUS
                                : btDispatcherInfo::DISPATCH_DISCRETE;
      return;
    case EventKind::order:
      info.m_deterministicOverlappingPairs = !info.m_deterministicOverlappingPairs;
      return;
    case EventKind::callbacks:
      set_near_callback((event.bits & kNear) != 0);
      return;
    default:
      break;
  }
  if (a == nullptr) return;
  switch (event.kind) {
    case EventKind::teleport:
      place(a, to_bullet(event.v));
      if (event.x > 1) a->activate();
      break;
    case EventKind::toggle:
      if (a->isInWorld()) {
        leave(a);
      } else {
        enter(event.a);
      }
      break;
    case EventKind::radius:
      if (a->getCollisionShape()->getShapeType() == SPHERE_SHAPE_PROXYTYPE) {
        static_cast<btSphereShape*>(a->getCollisionShape())
            ->setUnscaledRadius(random_.bodies[event.a].size * event.x);
      }
      break;
    case EventKind::scale:
      if (random_.bodies[event.a].shape == ShapeKind::heights) {
        const btScalar cell = random_.bodies[event.a].size * event.x;
        a->getCollisionShape()->setLocalScaling(btVector3(cell, event.x, cell));
      } else {
        a->getCollisionShape()->setLocalScaling(btVector3(event.x, -event.x, event.x));
      }
      break;
    case EventKind::deform:
      deform(event);
      break;
    case EventKind::reshape:
      reshape(event.a);
      break;
    case EventKind::push:
      a->setLinearVelocity(to_bullet(event.v * event.x));
      a->setAngularVelocity(btVector3(0, event.x, 0));
      break;
    case EventKind::activation: {
      constexpr int kStates[] = {ACTIVE_TAG, ISLAND_SLEEPING, WANTS_DEACTIVATION,
                                 DISABLE_DEACTIVATION, DISABLE_SIMULATION};
      a->forceActivationState(kStates[event.bits % 5]);
      break;
    }
    case EventKind::ignore:
      if (b != nullptr && a != b) {
        const std::pair pair(event.a, event.b);
        const bool ignore = ignored_.insert(pair).second;
        if (!ignore) ignored_.erase(pair);
        a->setIgnoreCollisionCheck(b, ignore);
      }
      break;
    case EventKind::traits:
      if (event.x > 1) {
        a->setCollisionFlags(a->getCollisionFlags() ^ btCollisionObject::CF_NO_CONTACT_RESPONSE);
      } else {
        a->setCollisionFlags(a->getCollisionFlags() ^
                             btCollisionObject::CF_CUSTOM_MATERIAL_CALLBACK);
      }
      break;
    case EventKind::filter:
      if (a->isInWorld()) {
        a->getBroadphaseHandle()->m_collisionFilterGroup = 1 << (event.bits % 4);
        a->getBroadphaseHandle()->m_collisionFilterMask = static_cast<int>(event.bits / 4 % 16);
        live_.world.refreshBroadphaseProxy(a);
      }
      break;
    case EventKind::contact_test:
      if (a->isInWorld()) {
        LoggingReport report;
        live_.world.contactTest(a, report);
      }
      break;
    case EventKind::contact_pair_test:
      if (b != nullptr && a != b && a->isInWorld() && b->isInWorld()) {
        LoggingReport report;
        report.m_closestDistanceThreshold = event.x > 1 ? random_.scale : btScalar(0);
        live_.world.contactPairTest(a, b, report);
      }
      break;
    default:
      break;
  }
}

}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
