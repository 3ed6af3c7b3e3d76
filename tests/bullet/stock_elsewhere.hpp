/// Stock Bullet with other leftovers on the stack, to tell its own irreproducible worlds from our
/// errors: in rare worlds Bullet 3.24 reads uninitialised memory of its stack, for example in
/// btPersistentManifold::refreshContactPoints (world 50183557 in float, seen by valgrind in a stock
/// world), and two stock worlds part ways.
#pragma once

#include "tests/bullet/solver_world.hpp"

namespace jfpx::inline JFPX_ABI::bullet {

/// Leftovers before each pair. Once a dispatch is not enough: what a pair finds there is left by
/// the pair before.
template <int kFill>
struct DispatcherElsewhere final : btCollisionDispatcher {
  using btCollisionDispatcher::btCollisionDispatcher;
  bool needsCollision(const btCollisionObject* a, const btCollisionObject* b) override {
    fill_stack<kFill>();
    return btCollisionDispatcher::needsCollision(a, b);
  }
  static std::unique_ptr<btCollisionDispatcher> make(btCollisionConfiguration* configuration,
                                                     const RandomWorld&) {
    return std::make_unique<DispatcherElsewhere>(configuration);
  }
};

/// Leftovers before and after each group.
template <int kFill>
struct SolverElsewhere final : btSequentialImpulseConstraintSolver {
  btScalar solveGroup(btCollisionObject** bodies, int body_count, btPersistentManifold** manifolds,
                      int manifold_count, btTypedConstraint** constraints, int constraint_count,
                      const btContactSolverInfo& info, btIDebugDraw* debug_drawer,
                      btDispatcher* dispatcher) override {
    fill_stack<kFill>();
    const btScalar result = btSequentialImpulseConstraintSolver::solveGroup(
        bodies, body_count, manifolds, manifold_count, constraints, constraint_count, info,
        debug_drawer, dispatcher);
    fill_stack<kFill>();
    return result;
  }
  static WorldParts parts(const SolverWorld&) {
    WorldParts made;
    made.solver = [] { return std::make_unique<SolverElsewhere>(); };
    return made;
  }
};

inline bool stock_differs_from_itself(const RandomWorld& world) {
  return run(world, nullptr, DispatcherElsewhere<0>::make) ||
         run(world, nullptr, DispatcherElsewhere<0x3f>::make) ||
         run(world, nullptr, DispatcherElsewhere<0xff>::make);
}

inline bool stock_differs_from_itself(const SolverWorld& world) {
  return run(world, nullptr, SolverElsewhere<0>::parts, DispatcherElsewhere<0>::make) ||
         run(world, nullptr, SolverElsewhere<0x3f>::parts, DispatcherElsewhere<0x3f>::make) ||
         run(world, nullptr, SolverElsewhere<0xff>::parts, DispatcherElsewhere<0xff>::make);
}

}  // namespace jfpx::inline JFPX_ABI::bullet
