/// The constraint solver moves worlds as Bullet's does.
#include <jfpx/bullet/constraint_solver.hpp>
#include <jfpx/error.hpp>

#include "tests/bullet/solver_world.hpp"

#include <sstream>

namespace jfpx::inline JFPX_ABI::bullet {
namespace {

/// Steps of worlds to run; JFPX_TEST_WORLD_STEPS asks for more, or for less.
std::uint64_t wanted_steps() {
  const char* asked = std::getenv("JFPX_TEST_WORLD_STEPS");
  if (asked != nullptr) return std::strtoull(asked, nullptr, 0);
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__) || !defined(NDEBUG)
  return 5'000;
#else
  return 100'000;
#endif
}

/// Bullet's solver, called with other leftovers on the stack: Bullet 3.24 itself reads
/// uninitialised memory in rare worlds (see random_worlds_test.cpp).
template <int kFill>
struct StockElsewhere final : btSequentialImpulseConstraintSolver {
  btScalar solveGroup(btCollisionObject** bodies, int body_count, btPersistentManifold** manifolds,
                      int manifold_count, btTypedConstraint** constraints, int constraint_count,
                      const btContactSolverInfo& info, btIDebugDraw* debug_drawer,
                      btDispatcher* dispatcher) override {
    fill_stack();
    const btScalar result = btSequentialImpulseConstraintSolver::solveGroup(
        bodies, body_count, manifolds, manifold_count, constraints, constraint_count, info,
        debug_drawer, dispatcher);
    fill_stack();
    return result;
  }
  [[gnu::noinline]] static void fill_stack() {
    volatile char leftovers[16384];
    for (volatile char& c : leftovers) c = static_cast<char>(kFill);
  }
  static WorldParts parts(const SolverWorld&) {
    WorldParts made;
    made.solver = [] { return std::make_unique<StockElsewhere>(); };
    return made;
  }
};

bool stock_differs_from_itself(const SolverWorld& world) {
  return run(world, nullptr, StockElsewhere<0>::parts) ||
         run(world, nullptr, StockElsewhere<0x3f>::parts) ||
         run(world, nullptr, StockElsewhere<0xff>::parts);
}

std::string report(const SolverWorld& world, const Failure& failure, MakeParts parts,
                   MakeDispatcher dispatcher) {
  const SolverWorld least = shrink(world, parts, dispatcher);
  const auto again = run(least, nullptr, parts, dispatcher);
  std::ostringstream out;
  out << failure.what << "\nshrunk: " << (again ? again->what : "no longer fails") << '\n' << least;
  return out.str();
}

/// Runs random worlds with these parts beside stock ones.
SolverTotals expect_stocks_bits(std::uint64_t steps, MakeParts parts, MakeDispatcher dispatcher) {
  const std::uint64_t seed = test_seed();
  SolverTotals totals;
  std::uint64_t unreproducible = 0;
  for (std::uint64_t i = 0; totals.steps < steps; ++i) {
    const SolverWorld world = make_solver_world(seed + i);
    const auto failure = run(world, &totals, parts, dispatcher);
    if (failure && stock_differs_from_itself(world)) {
      ++unreproducible;
      continue;
    }
    if (failure) {
      ADD_FAILURE() << "JFPX_TEST_SEED=" << seed + i << '\n'
                    << report(world, *failure, parts, dispatcher);
      return totals;
    }
  }
  EXPECT_LE(unreproducible, 1 + steps / 100'000) << "too many to be Bullet's";
  return totals;
}

TEST(ConstraintSolver, MovesRandomWorldsAsStock) {
  const SolverTotals totals = expect_stocks_bits(wanted_steps(), our_solver, make_stock);
  EXPECT_GT(totals.groups, totals.steps / 4) << "worlds that Bullet solves show nothing";
  EXPECT_GT(totals.contacts, totals.steps);
  EXPECT_GT(totals.joints, totals.steps / 20);
  for (std::size_t i = 0; i < kSolverFallbacks; ++i) {
    RecordProperty("fallbacks_" + std::to_string(i), std::to_string(totals.fallbacks[i]));
  }
}

TEST(DynamicsWorld, MovesRandomWorldsAsStock) {
  expect_stocks_bits(wanted_steps() / 4, our_world, make_stock);
}

TEST(DynamicsWorld, MovesRandomWorldsAsStockWithOurDispatcherAndSolver) {
  expect_stocks_bits(wanted_steps() / 4, our_solver_and_world, make_ours);
}

}  // namespace
}  // namespace jfpx::inline JFPX_ABI::bullet
