/// Comparison of random worlds with stock Bullet; see the header.
#include "tests/bullet/stock_bits.hpp"

#include <sstream>

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {
namespace {

std::string report(const SolverWorld& world, const Failure& failure, MakeParts parts,
                   MakeDispatcher dispatcher) {
  const SolverWorld least = shrink(world, parts, dispatcher);
  const auto again = run(least, nullptr, parts, dispatcher);
  std::ostringstream out;
  out << failure.what << "\nshrunk: " << (again ? again->what : "no longer fails") << '\n' << least;
  return out.str();
}

}  // namespace

std::uint64_t wanted_solver_steps() { return world_steps_to_run(5'000, 50'000); }

SolverTotals expect_stocks_bits(std::uint64_t steps, MakeParts parts, MakeDispatcher dispatcher) {
  const std::uint64_t seed = test_seed();
  SolverTotals totals;
  for (std::uint64_t i = 0; totals.steps < steps; ++i) {
    const SolverWorld world = make_solver_world(seed + i);
    const auto failure = run(world, &totals, parts, dispatcher);
    if (failure) {
      ADD_FAILURE() << "JFPX_TEST_SEED=" << seed + i << '\n'
                    << report(world, *failure, parts, dispatcher);
      return totals;
    }
  }
  return totals;
}

SolverWorld make_large_heap(std::uint64_t seed) {
  SolverWorld world;
  world.base.seed = seed;
  world.base.steps = 12;
  world.base.gravity = {0, -10, 0};
  Random random(seed);
  for (int i = 0; i < 700; ++i) {
    RandomBody body;
    body.size = random.uniform(Real(0.3), Real(0.6));
    body.position = random.uniform_in_box({0, 0, 0}, {7, 7, 7});
    body.mass = i == 0 ? Real(0) : random.uniform(Real(0.5), 2);
    body.restitution = random.uniform(0, Real(0.5));
    world.base.bodies.push_back(body);
  }
  world.bodies.resize(world.base.bodies.size());
  btContactSolverInfo info;
  info.m_solverMode ^= SOLVER_INTERLEAVE_CONTACT_AND_FRICTION_CONSTRAINTS;
  info.m_splitImpulsePenetrationThreshold = 0;
  world.changes.push_back({6, info});
  return world;
}

}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
