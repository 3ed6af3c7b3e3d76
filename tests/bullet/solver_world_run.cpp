/// Runs a solver world twice in parallel, with Bullet's components and with others.
#include <jfpx/bullet/constraint_solver.hpp>
#include <jfpx/bullet/dynamics_world.hpp>

#include "src/bullet/dispatch/point_fields.hpp"
#include "src/bullet/world/aabb_update.hpp"
#include "src/bullet/world/pair_cleanup.hpp"
#include "tests/bullet/live_random_world.hpp"
#include "tests/bullet/random_world_globals.hpp"
#include "tests/bullet/solver_world.hpp"

extern int gNumSplitImpulseRecoveries;

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {
namespace {

/// Updates AABBs in parallel however small the world is.
class SideBySideWorld final : public DynamicsWorld {
 public:
  SideBySideWorld(btDispatcher* dispatcher, btBroadphaseInterface* broadphase,
                  btConstraintSolver* solver, btCollisionConfiguration* configuration,
                  unsigned threads)
      : DynamicsWorld(dispatcher, broadphase, solver, configuration, {.threads = threads}),
        pool_(threads) {}
  void updateAabbs() override {
    if (!boxes_.run(*this, pool_)) DynamicsWorld::updateAabbs();
  }
  void computeOverlappingPairs() override {
    if (!cleanup_.run(*this, pool_)) DynamicsWorld::computeOverlappingPairs();
  }

 private:
  ThreadPool pool_;
  AabbUpdate boxes_{0};
  PairCleanup cleanup_{0};
};

btVector3 to_bullet(const Vec3& v) { return {v.x, v.y, v.z}; }

/// One of the two worlds, with its joints. The joints outlive the world.
class LiveSolverWorld {
 public:
  LiveSolverWorld(const SolverWorld& world, MakeDispatcher dispatcher, const WorldParts& parts)
      : live_(world.base, dispatcher, parts) {
    for (const auto& body : live_.live().bodies) {
      dress(body.get(), world.bodies[static_cast<std::size_t>(body->getUserIndex())]);
    }
    for (const SolverJoint& joint : world.joints) add_joint(joint);
  }
  LiveWorld& live() { return live_; }
  btDiscreteDynamicsWorld& bullet() { return live_.live().world; }
  const std::vector<std::unique_ptr<btTypedConstraint>>& joints() const { return joints_; }
  const std::vector<std::unique_ptr<btJointFeedback>>& feedbacks() const { return feedbacks_; }

  void change(const btContactSolverInfo& info) { bullet().getSolverInfo() = info; }

 private:
  static void dress(btRigidBody* body, const SolverBody& with) {
    body->setLinearFactor(to_bullet(with.linear_factor));
    body->setAngularFactor(to_bullet(with.angular_factor));
    if (with.gyroscopic != 0) body->setFlags(with.gyroscopic);
    body->setDamping(with.linear_damping, with.linear_damping / 2);
    if (with.massive && body->isKinematicObject()) {
      body->setMassProps(2, btVector3(1, 2, 3));
      body->setCollisionFlags(body->getCollisionFlags() | btCollisionObject::CF_KINEMATIC_OBJECT);
      body->updateInertiaTensor();
    }
  }

  btRigidBody* find(std::size_t index) {
    for (const auto& body : live_.live().bodies) {
      if (body->getUserIndex() == static_cast<int>(index)) return body.get();
    }
    return nullptr;
  }

  void add_joint(const SolverJoint& joint) {
    btRigidBody *a = find(joint.a), *b = find(joint.b);
    if (a == nullptr || b == nullptr || a == b || !a->isInWorld() || !b->isInWorld()) return;
    if (a->getInvMass() == 0 && (joint.alone || b->getInvMass() == 0)) return;
    std::unique_ptr<btTypedConstraint> made = make_joint(joint, *a, *b);
    made->setBreakingImpulseThreshold(joint.breaking);
    made->setOverrideNumSolverIterations(joint.iterations);
    if (joint.feedback) {
      feedbacks_.push_back(std::make_unique<btJointFeedback>());  // zeros
      made->setJointFeedback(feedbacks_.back().get());
    }
    bullet().addConstraint(made.get(), !joint.collide);
    joints_.push_back(std::move(made));
  }

  static std::unique_ptr<btTypedConstraint> make_joint(const SolverJoint& j, btRigidBody& a,
                                                       btRigidBody& b) {
    const btVector3 middle =
        (a.getWorldTransform().getOrigin() + b.getWorldTransform().getOrigin()) / 2;
    btTransform in_a = btTransform::getIdentity(), in_b = btTransform::getIdentity();
    in_a.setOrigin(a.getWorldTransform().invXform(middle));
    in_b.setOrigin(b.getWorldTransform().invXform(middle));
    const btVector3 axis(0, 0, 1), other_axis(1, 0, 0);
    btVector3 anchor = middle, up(0, 1, 0), forward(1, 0, 0);
    switch (j.kind) {
      case 1: {
        auto hinge = j.alone ? std::make_unique<btHingeConstraint>(a, in_a)
                             : std::make_unique<btHingeConstraint>(a, b, in_a, in_b);
        if (j.limits) hinge->setLimit(j.low, j.high);
        hinge->enableAngularMotor(j.motor, j.speed, j.strength);
        return hinge;
      }
      case 2: {
        auto slider = j.alone ? std::make_unique<btSliderConstraint>(a, in_a, true)
                              : std::make_unique<btSliderConstraint>(a, b, in_a, in_b, true);
        if (j.limits) {
          slider->setLowerLinLimit(j.low);
          slider->setUpperLinLimit(j.high);
        }
        slider->setPoweredLinMotor(j.motor);
        slider->setTargetLinMotorVelocity(j.speed);
        slider->setMaxLinMotorForce(j.strength);
        return slider;
      }
      case 3: {
        auto cone = j.alone ? std::make_unique<btConeTwistConstraint>(a, in_a)
                            : std::make_unique<btConeTwistConstraint>(a, b, in_a, in_b);
        if (j.limits) cone->setLimit(Real(0.4), Real(0.6), Real(0.3));
        cone->enableMotor(j.motor);
        cone->setMaxMotorImpulse(j.strength);
        cone->setMotorTarget(btQuaternion(up, j.speed / 5));
        return cone;
      }
      case 4:
      case 5: {
        auto spring = std::make_unique<btGeneric6DofSpringConstraint>(a, b, in_a, in_b, true);
        if (j.limits) {
          spring->setLinearLowerLimit(btVector3(j.low, 0, 0));
          spring->setLinearUpperLimit(btVector3(j.high, 0, 0));
        }
        spring->enableSpring(0, j.kind == 5);
        spring->setStiffness(0, j.strength);
        spring->getRotationalLimitMotor(1)->m_enableMotor = j.motor;
        spring->getRotationalLimitMotor(1)->m_targetVelocity = j.speed;
        spring->getRotationalLimitMotor(1)->m_maxMotorForce = j.strength;
        return spring;
      }
      case 6: {
        auto spring = std::make_unique<btGeneric6DofSpring2Constraint>(a, b, in_a, in_b);
        if (j.limits) spring->setLimit(0, j.low, j.high);
        spring->enableSpring(1, true);
        spring->setStiffness(1, j.strength);
        spring->enableMotor(2, j.motor);
        spring->setTargetVelocity(2, j.speed);
        spring->setMaxMotorForce(2, j.strength);
        return spring;
      }
      case 7:
        return std::make_unique<btFixedConstraint>(a, b, in_a, in_b);
      case 8:
        return std::make_unique<btUniversalConstraint>(a, b, anchor, up, forward);
      case 9:
        return std::make_unique<btHinge2Constraint>(a, b, anchor, up, forward);
      case 10:
        return std::make_unique<btGearConstraint>(a, b, axis, other_axis, j.high + 1);
      default:
        break;
    }
    if (j.alone) return std::make_unique<btPoint2PointConstraint>(a, in_a.getOrigin());
    return std::make_unique<btPoint2PointConstraint>(a, b, in_a.getOrigin(), in_b.getOrigin());
  }

  std::vector<std::unique_ptr<btJointFeedback>> feedbacks_;
  std::vector<std::unique_ptr<btTypedConstraint>> joints_;
  LiveWorld live_;
};

/// Compares state that first_difference() does not compare, but users of a solver may read.
std::optional<std::string> compare_solvers(LiveSolverWorld& stock, LiveSolverWorld& ours) {
  FieldComparison c;
  for (std::size_t i = 0; i < stock.joints().size(); ++i) {
    btTypedConstraint &s = *stock.joints()[i], &o = *ours.joints()[i];
    c("joint impulse", s.internalGetAppliedImpulse(), o.internalGetAppliedImpulse());
  }
  for (std::size_t i = 0; i < stock.feedbacks().size(); ++i) {
    const btJointFeedback &s = *stock.feedbacks()[i], &o = *ours.feedbacks()[i];
    c("joint force a", s.m_appliedForceBodyA, o.m_appliedForceBodyA);
    c("joint torque b", s.m_appliedTorqueBodyB, o.m_appliedTorqueBodyB);
  }
  for (std::size_t i = 0; i < stock.live().live().bodies.size(); ++i) {
    const btRigidBody& s = *stock.live().live().bodies[i];
    const btRigidBody& o = *ours.live().live().bodies[i];
    c("companion id", s.getCompanionId(), o.getCompanionId());
    c("inertia", s.getInvInertiaTensorWorld()[0], o.getInvInertiaTensorWorld()[0]);
  }
  const btSolverAnalyticsData& s = stock.live().live().solver->m_analyticsData;
  const btSolverAnalyticsData& o = ours.live().live().solver->m_analyticsData;
  c("solver calls", s.m_numSolverCalls, o.m_numSolverCalls);
  c("iterations used", s.m_numIterationsUsed, o.m_numIterationsUsed);
  c("island of the last group", s.m_islandId, o.m_islandId);
  if (s.m_numSolverCalls > 0) {
    c("bodies of the last group", s.m_numBodies, o.m_numBodies);
    c("manifolds of the last group", s.m_numContactManifolds, o.m_numContactManifolds);
  }
  c("residual", static_cast<btScalar>(s.m_remainingLeastSquaresResidual),
    static_cast<btScalar>(o.m_remainingLeastSquaresResidual));
  if (!c.first()) return std::nullopt;
  return to_text(*c.first());
}

}  // namespace

WorldParts our_solver(const SolverWorld& world) {
  WorldParts parts;
  parts.solver = [threads = world.threads,
                  simd = world.vectors ? SimdLevel::automatic : SimdLevel::scalar] {
    return std::make_unique<ConstraintSolver>(
        ConstraintSolverOptions{.threads = threads, .simd = simd, .minimum_batch = 0});
  };
  return parts;
}

WorldParts our_world(const SolverWorld& world) {
  WorldParts parts;
  parts.world = [threads = world.threads](
                    btDispatcher* dispatcher, btBroadphaseInterface* broadphase,
                    btConstraintSolver* solver, btCollisionConfiguration* configuration) {
    return std::make_unique<SideBySideWorld>(dispatcher, broadphase, solver, configuration,
                                             threads);
  };
  return parts;
}

WorldParts our_solver_and_world(const SolverWorld& world) {
  return {.solver = our_solver(world).solver, .world = our_world(world).world};
}

std::optional<Failure> run(const SolverWorld& world, SolverTotals* totals, MakeParts parts,
                           MakeDispatcher dispatcher) {
  Globals globals(world.base);
  LiveSolverWorld stock(world, make_stock, {}), ours(world, dispatcher, parts(world));
  LiveSolverWorld* const both[] = {&stock, &ours};
  int recoveries[2] = {};
  auto event = world.base.events.begin();
  for (int step = 0; step < world.base.steps; ++step) {
    for (const SolverChange& change : world.changes) {
      if (change.step != step) continue;
      for (LiveSolverWorld* live : both) live->change(change.info);
    }
    for (; event != world.base.events.end() && event->step <= step; ++event) {
      if (event->kind == EventKind::callbacks) globals.set_callbacks(event->bits);
      for (LiveSolverWorld* live : both) {
        g_current = &live->live().live();
        live->live().apply(*event);
      }
    }
    for (int i = 0; i < 2; ++i) {
      g_current = &both[i]->live().live();
      gNumSplitImpulseRecoveries = 0;
      both[i]->live().step();
      recoveries[i] = gNumSplitImpulseRecoveries;
    }
    if (const auto difference =
            first_difference(stock.bullet(), ours.bullet(), static_cast<std::uint64_t>(step) + 1)) {
      return Failure{step + 1, to_text(*difference)};
    }
    if (const auto what = compare_solvers(stock, ours)) return Failure{step + 1, *what};
    if (recoveries[0] != recoveries[1]) return Failure{step + 1, "split impulse recoveries"};
  }
  if (totals != nullptr) {
    totals->steps += static_cast<std::uint64_t>(world.base.steps);
    if (const auto* solver =
            dynamic_cast<const ConstraintSolver*>(ours.live().live().solver.get())) {
      totals->groups += solver->stats().groups;
      totals->on_device += solver->stats().on_device;
      totals->contacts += solver->stats().contacts;
      totals->joints += solver->stats().joints;
      for (std::size_t i = 0; i < kSolverFallbacks; ++i) {
        totals->fallbacks[i] += solver->stats().fallbacks[i];
      }
    }
  }
  return std::nullopt;
}

}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
