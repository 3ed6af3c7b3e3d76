/// Running a random world twice at once, with Bullet's dispatcher and with another.
#include "tests/bullet/random_world.hpp"

#include <BulletCollision/BroadphaseCollision/btAxisSweep3.h>
#include <BulletCollision/BroadphaseCollision/btSimpleBroadphase.h>
#include <BulletCollision/CollisionDispatch/btSimulationIslandManager.h>
#include <BulletCollision/CollisionShapes/btCompoundShape.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <set>
#include <utility>

namespace jfpx::inline JFPX_ABI::bullet {
namespace {

btVector3 to_bullet(const Vec3& v) { return {v.x, v.y, v.z}; }

std::string bits_of(btScalar value) {
  char text[32];
  std::snprintf(text, sizeof text, " %a", static_cast<double>(value));
  return text;
}

bool on_added(btManifoldPoint& point, const btCollisionObjectWrapper* a, int part_a, int index_a,
              const btCollisionObjectWrapper* b, int part_b, int index_b) {
  log_event("added " + name_of(a->getCollisionObject()) + " " + name_of(b->getCollisionObject()) +
            bits_of(point.m_distance1) + bits_of(point.m_combinedFriction) + " " +
            std::to_string(part_a + part_b) + " " + std::to_string(index_a) + " " +
            std::to_string(index_b));
  point.m_combinedFriction *= btScalar(0.5);
  point.m_userPersistentData = const_cast<btCollisionObject*>(a->getCollisionObject());
  return true;
}
bool on_processed(btManifoldPoint& point, void* a, void* b) {
  log_event("processed " + name_of(static_cast<btCollisionObject*>(a)) + " " +
            name_of(static_cast<btCollisionObject*>(b)) + bits_of(point.m_distance1));
  return true;
}
bool on_destroyed(void* data) {
  log_event("destroyed " + name_of(static_cast<btCollisionObject*>(data)));
  return true;
}
void on_started(btPersistentManifold* const& manifold) {
  log_event("started " + name_of(manifold->getBody0()) + " " + name_of(manifold->getBody1()) + " " +
            std::to_string(manifold->getNumContacts()));
}
void on_ended(btPersistentManifold* const& manifold) {
  log_event("ended " + name_of(manifold->getBody0()) + " " + name_of(manifold->getBody1()) + " " +
            std::to_string(manifold->getNumContacts()));
}
btScalar sum_of_frictions(const btCollisionObject* a, const btCollisionObject* b) {
  log_event("combine " + name_of(a) + " " + name_of(b));
  return a->getFriction() + b->getFriction();
}
void near_callback(btBroadphasePair& pair, btCollisionDispatcher& dispatcher,
                   const btDispatcherInfo& info) {
  log_event("near " + name_of(static_cast<btCollisionObject*>(pair.m_pProxy0->m_clientObject)) +
            " " + name_of(static_cast<btCollisionObject*>(pair.m_pProxy1->m_clientObject)));
  btCollisionDispatcher::defaultNearCallback(pair, dispatcher, info);
}

struct Report : btCollisionWorld::ContactResultCallback {
  btScalar addSingleResult(btManifoldPoint& point, const btCollisionObjectWrapper* a, int, int i,
                           const btCollisionObjectWrapper* b, int, int j) override {
    log_event("tested " + name_of(a->getCollisionObject()) + " " +
              name_of(b->getCollisionObject()) + bits_of(point.m_distance1) + " " +
              std::to_string(i) + " " + std::to_string(j));
    return 0;
  }
};

/// Bullet's global settings, put back at the end.
class Globals {
 public:
  explicit Globals(btScalar breaking_threshold) {
    gContactBreakingThreshold = breaking_threshold;
    gDeactivationTime = btScalar(0.15);  // runs are too short for two seconds
  }
  ~Globals() {
    set_callbacks(0);
    gContactBreakingThreshold = breaking_threshold_;
    gDeactivationTime = deactivation_time_;
  }
  Globals(const Globals&) = delete;
  Globals& operator=(const Globals&) = delete;

  void set_callbacks(unsigned bits) {
    gContactAddedCallback = (bits & kAdded) != 0 ? on_added : nullptr;
    gContactProcessedCallback = (bits & kProcessed) != 0 ? on_processed : nullptr;
    gContactDestroyedCallback = (bits & kDestroyed) != 0 ? on_destroyed : nullptr;
    gContactStartedCallback = (bits & kStarted) != 0 ? on_started : nullptr;
    gContactEndedCallback = (bits & kEnded) != 0 ? on_ended : nullptr;
    gCalculateCombinedFrictionCallback = (bits & kCombine) != 0 ? sum_of_frictions : friction_;
  }

 private:
  const btScalar breaking_threshold_ = gContactBreakingThreshold;
  const btScalar deactivation_time_ = gDeactivationTime;
  const CalculateCombinedCallback friction_ = gCalculateCombinedFrictionCallback;
};

/// One of the two worlds.
class LiveWorld {
 public:
  LiveWorld(const RandomWorld& world, MakeDispatcher make_dispatcher)
      : random_(world),
        live_(
            make_configuration(),
            [&](btCollisionConfiguration* c) { return make_dispatcher(c, random_); },
            make_broadphase()) {
    g_current = &live_;
    live_.world.setGravity(to_bullet(random_.gravity));
    live_.world.getDispatchInfo().m_deterministicOverlappingPairs = random_.deterministic;
    live_.world.getSimulationIslandManager()->setSplitIslands(random_.split_islands);
    for (std::size_t i = 0; i < random_.bodies.size(); ++i) add_body(i);
    for (const RandomJoint& joint : random_.joints) add_joint(joint);
  }
  ~LiveWorld() {
    g_current = &live_;
    while (live_.world.getNumConstraints() > 0) remove_joint(live_.world.getConstraint(0));
    for (btRigidBody* body : bodies_) {
      if (body != nullptr && body->isInWorld()) live_.world.removeRigidBody(body);
    }
    g_current = nullptr;
  }
  LiveWorld(const LiveWorld&) = delete;
  LiveWorld& operator=(const LiveWorld&) = delete;

  BulletWorld& live() { return live_; }
  void happen(const RandomEvent& event);
  void set_near_callback(bool on) {
    live_.dispatcher->setNearCallback(on ? near_callback
                                         : btCollisionDispatcher::defaultNearCallback);
  }
  void step() {
    for (std::size_t i = 0; i < bodies_.size(); ++i) {
      if (bodies_[i] == nullptr || (random_.bodies[i].traits & kKinematic) == 0) continue;
      btTransform pose = bodies_[i]->getWorldTransform();
      pose.setOrigin(pose.getOrigin() + to_bullet(random_.bodies[i].velocity) * random_.dt);
      bodies_[i]->setWorldTransform(pose);
    }
    const btScalar fixed = random_.sub_steps > 0 ? random_.dt / 2 : random_.dt;
    live_.world.stepSimulation(random_.dt, random_.sub_steps, fixed);
  }

 private:
  std::unique_ptr<btCollisionConfiguration> make_configuration() const {
    btDefaultCollisionConstructionInfo info;
    info.m_defaultMaxPersistentManifoldPoolSize = random_.pool;
    info.m_defaultMaxCollisionAlgorithmPoolSize = random_.pool;
    return std::make_unique<btDefaultCollisionConfiguration>(info);
  }
  std::unique_ptr<btBroadphaseInterface> make_broadphase() {
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

  btCollisionShape* make_shape(const RandomBody& body) {
    const btScalar s = body.size;
    switch (body.shape) {
      case ShapeKind::sphere:
        break;
      case ShapeKind::box:
        return live_.keep(new btBoxShape(btVector3(s, s, s)));
      case ShapeKind::plane:
        return live_.keep(new btStaticPlaneShape(btVector3(0, 1, 0), 0));
      case ShapeKind::capsule:
        return live_.keep(new btCapsuleShape(s / 2, s));
      case ShapeKind::compound: {
        auto* compound = new btCompoundShape();
        live_.keep(compound);
        btTransform at = btTransform::getIdentity();
        for (int k = -1; k <= 1; ++k) {
          at.setOrigin(btVector3(btScalar(k) * s, 0, 0));
          compound->addChildShape(at, live_.keep(new btSphereShape(s / 2)));
        }
        return compound;
      }
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

  void add_body(std::size_t i) {
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

  static void apply_traits(btRigidBody* made, const RandomBody& body) {
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
      made->setAnisotropicFriction(btVector3(1, btScalar(0.5), btScalar(0.2)));
    }
    if ((body.traits & kMargin) != 0) {
      made->getCollisionShape()->setMargin(body.size / 16);
      made->setContactProcessingThreshold(body.size / 32);
    }
  }

  static void place(btRigidBody* body, const btVector3& position) {
    btTransform pose = body->getWorldTransform();
    pose.setOrigin(position);
    body->setWorldTransform(pose);
    body->setInterpolationWorldTransform(pose);
  }

  /// Puts the body into the world, at its first place if it has left the finite numbers.
  void enter(std::size_t i) {
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

  void add_joint(const RandomJoint& joint) {
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
  void remove_joint(btTypedConstraint* joint) {
    live_.world.removeConstraint(joint);
    std::erase_if(joints_, [&](const auto& owned) { return owned.get() == joint; });
  }
  void leave(btRigidBody* body) {
    for (int i = live_.world.getNumConstraints() - 1; i >= 0; --i) {
      btTypedConstraint* joint = live_.world.getConstraint(i);
      if (&joint->getRigidBodyA() == body || &joint->getRigidBodyB() == body) remove_joint(joint);
    }
    live_.world.removeRigidBody(body);
  }
  void reshape(std::size_t i) {
    btRigidBody* body = bodies_[i];
    if (random_.bodies[i].shape == ShapeKind::plane) return;
    // As Bullet wants it: the pairs are cleaned when the type of a shape changes.
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

  const RandomWorld& random_;
  btSortedOverlappingPairCache sorted_pairs_;
  BulletWorld live_;
  std::vector<btRigidBody*> bodies_;  ///< null where a body is not used
  std::vector<btCollisionShape*> other_shapes_;
  std::vector<std::pair<btScalar, btCollisionShape*>> shared_spheres_;
  std::vector<std::unique_ptr<btTypedConstraint>> joints_;
  std::set<std::pair<std::size_t, std::size_t>> ignored_;
};

void LiveWorld::happen(const RandomEvent& event) {
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
      a->getCollisionShape()->setLocalScaling(btVector3(event.x, -event.x, event.x));
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
        Report report;
        live_.world.contactTest(a, report);
      }
      break;
    case EventKind::contact_pair_test:
      if (b != nullptr && a != b && a->isInWorld() && b->isInWorld()) {
        Report report;
        report.m_closestDistanceThreshold = event.x > 1 ? random_.scale : btScalar(0);
        live_.world.contactPairTest(a, b, report);
      }
      break;
    default:
      break;
  }
}

std::string first_log_difference(const std::vector<std::string>& stock,
                                 const std::vector<std::string>& ours) {
  const auto [s, o] = std::mismatch(stock.begin(), stock.end(), ours.begin(), ours.end());
  return "event " + std::to_string(s - stock.begin()) + " is \"" +
         (o == ours.end() ? "missing" : *o) + "\"; stock: \"" +
         (s == stock.end() ? "missing" : *s) + "\"";
}

std::optional<std::string> compare(LiveWorld& stock, LiveWorld& ours, int step) {
  if (const auto difference = first_difference(stock.live().world, ours.live().world,
                                               static_cast<std::uint64_t>(step))) {
    return to_text(*difference);
  }
  if (stock.live().log != ours.live().log) {
    return first_log_difference(stock.live().log, ours.live().log);
  }
  stock.live().log.clear();
  ours.live().log.clear();
  const CollisionDispatcher* dispatcher = ours.live().ours();
  if (dispatcher != nullptr && dispatcher->stats().mismatches > 0) {
    return "verify: " + dispatcher->stats().first_mismatch;
  }
  if (dispatcher != nullptr && !dispatcher->stats().failure.empty()) {
    return "the collider failed: " + dispatcher->stats().failure;
  }
  return std::nullopt;
}

void add_totals(const RandomWorld& world, LiveWorld& ours, RunTotals* totals) {
  totals->steps += static_cast<std::uint64_t>(world.steps);
  totals->events += world.events.size();
  const CollisionDispatcher* dispatcher = ours.live().ours();
  if (dispatcher == nullptr) return;
  totals->batches += dispatcher->stats().batches;
  totals->touching += dispatcher->stats().touching;
  totals->written += dispatcher->stats().written;
  totals->verified += dispatcher->stats().verified;
}

}  // namespace

std::unique_ptr<btCollisionDispatcher> make_stock(btCollisionConfiguration* configuration,
                                                  const RandomWorld&) {
  return std::make_unique<btCollisionDispatcher>(configuration);
}

std::unique_ptr<btCollisionDispatcher> make_ours(btCollisionConfiguration* configuration,
                                                 const RandomWorld& world) {
  return std::make_unique<CollisionDispatcher>(
      configuration,
      DispatcherOptions{.minimum_batch = world.minimum_batch, .verify = world.verify});
}

std::optional<Failure> run(const RandomWorld& world, RunTotals* totals, MakeDispatcher make) {
  Globals globals(world.breaking_threshold);
  // set_verify() says that it calls them twice.
  const unsigned allowed = world.verify ? ~unsigned{kCombine} : ~0u;
  globals.set_callbacks(world.callbacks & allowed);
  LiveWorld stock(world, make_stock), ours(world, make);
  LiveWorld* const both[] = {&stock, &ours};
  for (LiveWorld* live : both) live->set_near_callback((world.callbacks & kNear) != 0);
  auto event = world.events.begin();
  for (int step = 0; step < world.steps; ++step) {
    for (; event != world.events.end() && event->step <= step; ++event) {
      if (event->kind == EventKind::callbacks) globals.set_callbacks(event->bits & allowed);
      for (LiveWorld* live : both) {
        g_current = &live->live();
        live->happen(*event);
      }
    }
    for (LiveWorld* live : both) {
      g_current = &live->live();
      live->step();
    }
    if (auto what = compare(stock, ours, step + 1)) return Failure{step + 1, std::move(*what)};
  }
  if (totals != nullptr) add_totals(world, ours, totals);
  return std::nullopt;
}

}  // namespace jfpx::inline JFPX_ABI::bullet
