/// Generation and shrinking of solver worlds; see the header.
#include "tests/bullet/solver_world.hpp"

#include <cmath>
#include <ostream>
#include <utility>

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {
namespace {

// `random` is a Random, or test::Bytes.
bool chance(auto& random, Real share) { return random.uniform() < share; }
Real one_of(auto& random, std::initializer_list<Real> values) {
  return values.begin()[random.below(values.size())];
}

btContactSolverInfo random_info(auto& random) {
  btContactSolverInfo info;
  const auto maybe = [&](btScalar* value, std::initializer_list<Real> values) {
    if (chance(random, Real(0.25))) *value = one_of(random, values);
  };
  if (chance(random, Real(0.3))) info.m_numIterations = static_cast<int>(random.below(15));
  maybe(&info.m_sor, {Real(0.5), Real(1.2), 1});
  maybe(&info.m_erp, {0, Real(0.8), 1});
  maybe(&info.m_erp2, {0, Real(0.8), 1});
  maybe(&info.m_globalCfm, {Real(0.01), Real(1e-5)});
  maybe(&info.m_frictionERP, {0, Real(0.7)});
  maybe(&info.m_splitImpulsePenetrationThreshold, {Real(-0.001), 0, Real(0.01), Real(-0.5)});
  maybe(&info.m_splitImpulseTurnErp, {0, 1});
  maybe(&info.m_linearSlop, {Real(0.01), Real(-0.01)});
  maybe(&info.m_warmstartingFactor, {0, 1, Real(0.5)});
  maybe(&info.m_leastSquaresResidualThreshold, {Real(1e-12), Real(1e-4), 1, -1});
  maybe(&info.m_restitutionVelocityThreshold, {0, 1});
  maybe(&info.m_maxGyroscopicForce, {1});
  maybe(&info.m_damping, {Real(0.5)});
  if (chance(random, Real(0.25))) info.m_splitImpulse = false;
  if (chance(random, Real(0.3))) info.m_minimumSolverBatchSize = static_cast<int>(random.below(9));
  const auto toggle = [&](int bit, Real share) {
    if (chance(random, share)) info.m_solverMode ^= bit;
  };
  toggle(SOLVER_USE_WARMSTARTING, Real(0.15));
  toggle(SOLVER_SIMD, Real(0.1));
  toggle(SOLVER_INTERLEAVE_CONTACT_AND_FRICTION_CONSTRAINTS, Real(0.2));
  toggle(SOLVER_DISABLE_VELOCITY_DEPENDENT_FRICTION_DIRECTION, Real(0.15));
  toggle(SOLVER_USE_2_FRICTION_DIRECTIONS, Real(0.1));
  toggle(SOLVER_ENABLE_FRICTION_DIRECTION_CACHING, Real(0.05));
  toggle(SOLVER_RANDMIZE_ORDER, Real(0.05));
  return info;
}

SolverBody random_body(auto& random) {
  SolverBody body;
  if (chance(random, Real(0.05))) body.linear_factor = {1, 0, 1};
  if (chance(random, Real(0.05))) body.angular_factor = {0, 0, 0};
  if (chance(random, Real(0.05))) body.angular_factor = {Real(0.5), 1, 2};
  if (chance(random, Real(0.1))) {
    constexpr int kFlags[] = {BT_DISABLE_WORLD_GRAVITY, BT_ENABLE_GYROSCOPIC_FORCE_EXPLICIT,
                              BT_ENABLE_GYROSCOPIC_FORCE_IMPLICIT_WORLD,
                              BT_ENABLE_GYROSCOPIC_FORCE_IMPLICIT_BODY};
    body.gyroscopic = kFlags[random.below(4)];
  }
  if (chance(random, Real(0.2))) body.linear_damping = Real(0.3);
  body.massive = chance(random, Real(0.02));
  return body;
}

SolverJoint random_joint(auto& random, std::size_t bodies) {
  SolverJoint joint;
  joint.kind = random.below(kJointKinds);
  joint.a = random.below(bodies);
  joint.b = random.below(bodies);
  joint.alone = chance(random, Real(0.2));
  joint.collide = chance(random, Real(0.7));
  joint.limits = chance(random, Real(0.5));
  joint.motor = chance(random, Real(0.4));
  joint.feedback = chance(random, Real(0.3));
  if (chance(random, Real(0.15))) joint.iterations = static_cast<int>(random.below(25));
  if (chance(random, Real(0.2))) joint.breaking = random.uniform(0, 10);
  joint.low = random.uniform(-2, Real(0.5));
  joint.high = random.uniform(Real(-0.5), 2);
  joint.speed = random.uniform(-5, 5);
  joint.strength = random.uniform(0, 20);
  return joint;
}

/// Adds more spheres than vectors have lanes, with so much overlap that all touch.
void add_heap(auto& random, RandomWorld* world) {
  const std::uint64_t count = 20 + random.below(150);
  const Real edge = world->scale * std::cbrt(static_cast<Real>(count)) * random.uniform(1, 2);
  for (std::uint64_t i = 0; i < count; ++i) {
    RandomBody body;
    body.size = world->scale * random.uniform(Real(0.5), 1);
    body.position = random.uniform_in_box({0, 0, 0}, {edge, edge, edge});
    body.mass = random.uniform(Real(0.5), 2);
    body.friction = random.uniform(0, 1);
    body.restitution = chance(random, Real(0.3)) ? random.uniform(0, 1) : Real(0);
    world->bodies.push_back(body);
  }
  world->steps = std::min(world->steps, 20);
}

SolverWorld draw_world(auto& random, RandomWorld base) {
  SolverWorld world;
  world.base = std::move(base);
  if (chance(random, Real(0.5))) {
    for (RandomBody& body : world.base.bodies) body.rolling = 0;
  }
  if (chance(random, Real(0.25))) add_heap(random, &world.base);
  for (std::size_t i = 0; i < world.base.bodies.size(); ++i) {
    world.bodies.push_back(random_body(random));
  }
  // A single factor selects the kernels with factors for the whole world.
  if (chance(random, Real(0.6))) {
    for (SolverBody& body : world.bodies) {
      body.linear_factor = body.angular_factor = {1, 1, 1};
    }
  }
  if (chance(random, Real(0.4))) {
    for (std::uint64_t n = 1 + random.below(6); n > 0; --n) {
      world.joints.push_back(random_joint(random, world.base.bodies.size()));
    }
  } else {
    world.base.joints.clear();
  }
  if (chance(random, Real(0.6))) {
    for (std::uint64_t n = 1 + random.below(4); n > 0; --n) {
      const int at = static_cast<int>(random.below(static_cast<std::uint64_t>(world.base.steps)));
      world.changes.push_back({chance(random, Real(0.4)) ? 0 : at, random_info(random)});
    }
  }
  if (chance(random, Real(0.2))) world.threads = 2 + static_cast<unsigned>(random.below(2));
  world.vectors = !chance(random, Real(0.2));
  return world;
}

}  // namespace

SolverWorld make_solver_world(std::uint64_t seed) {
  Random random(seed ^ 0x5eed'501e'0000'0001ull);
  return draw_world(random, make_random_world(seed));
}

SolverWorld make_solver_world(test::Bytes& bytes) {
  RandomWorld base = make_random_world(bytes);
  return draw_world(bytes, std::move(base));
}

std::ostream& operator<<(std::ostream& out, const SolverWorld& world) {
  out << world.base << "threads " << world.threads << ", vectors " << world.vectors << '\n';
  for (std::size_t i = 0; i < world.bodies.size(); ++i) {
    if (!world.base.bodies[i].used) continue;
    const SolverBody& b = world.bodies[i];
    out << "  body " << i << ": linear factor " << b.linear_factor.y << ", angular factor "
        << b.angular_factor.x << ' ' << b.angular_factor.z << ", gyroscopic " << b.gyroscopic
        << ", damping " << b.linear_damping << ", massive " << b.massive << '\n';
  }
  for (const SolverJoint& j : world.joints) {
    out << "  joint of kind " << j.kind << " of " << j.a << " and " << j.b << ", alone " << j.alone
        << ", collide " << j.collide << ", limits " << j.limits << ", motor " << j.motor
        << ", feedback " << j.feedback << ", iterations " << j.iterations << ", breaking "
        << j.breaking << ", " << j.low << " to " << j.high << ", speed " << j.speed << ", strength "
        << j.strength << '\n';
  }
  for (const SolverChange& c : world.changes) {
    out << "  from step " << c.step << ": iterations " << c.info.m_numIterations << ", mode "
        << c.info.m_solverMode << ", split " << c.info.m_splitImpulse << " from "
        << c.info.m_splitImpulsePenetrationThreshold << ", sor " << c.info.m_sor << ", cfm "
        << c.info.m_globalCfm << ", threshold " << c.info.m_leastSquaresResidualThreshold
        << ", batch " << c.info.m_minimumSolverBatchSize << '\n';
  }
  return out;
}

SolverWorld shrink(SolverWorld world, MakeParts parts, MakeDispatcher dispatcher) {
  bool changed = true;
  const auto try_out = [&](const SolverWorld& candidate) {
    if (!run(candidate, nullptr, parts, dispatcher)) return;
    world = candidate;
    changed = true;
  };
  const auto drop = [&](auto list) {
    for (std::size_t i = list(world).size(); i-- > 0;) {
      SolverWorld candidate = world;
      auto& items = list(candidate);
      items.erase(items.begin() + static_cast<std::ptrdiff_t>(i));
      try_out(candidate);
    }
  };
  while (changed) {
    changed = false;
    const auto failure = run(world, nullptr, parts, dispatcher);
    if (failure && failure->step < world.base.steps) {
      world.base.steps = failure->step;
      changed = true;
    }
    for (std::size_t i = world.base.bodies.size(); i-- > 0;) {
      if (!world.base.bodies[i].used) continue;
      SolverWorld candidate = world;
      candidate.base.bodies[i].used = false;
      try_out(candidate);
    }
    drop([](SolverWorld & w) -> auto& { return w.base.events; });
    drop([](SolverWorld & w) -> auto& { return w.base.joints; });
    drop([](SolverWorld & w) -> auto& { return w.joints; });
    drop([](SolverWorld & w) -> auto& { return w.changes; });
  }
  return world;
}

}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
