/// Detection of nondeterminism in stock Bullet, which is no error of jfpx: in rare worlds, Bullet
/// 3.24 reads uninitialized memory of its stack, for example in
/// btPersistentManifold::refreshContactPoints (world 50183557 in float, reported by valgrind for a
/// stock world), and two stock worlds diverge. Stock Bullet is run with different stack contents.
#pragma once

#include "tests/bullet/solver_world.hpp"

#include <array>
#include <cmath>
#include <limits>

// Fuzz targets count the branches that an input takes, which would take most of the time of a loop.
#if defined(__clang__)
#define JFPX_NO_COVERAGE [[clang::no_sanitize("coverage")]]
#else
#define JFPX_NO_COVERAGE
#endif

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {

/// Values that are left on the stack for uninitialized reads: zeros, as memory has that nothing has
/// used, or values that differ from each other, because the differences of equal values are 0.
class StackResidue {
 public:
  StackResidue() = default;
  /// Values of either sign with binary exponents in [low, high].
  StackResidue(int low, int high, std::uint64_t seed) {
    Random random(seed);
    const auto exponents = static_cast<std::uint64_t>(high - low + 1);
    for (Real& number : numbers_) {
      const Real mantissa =
          random.below(2) == 0 ? random.uniform(-1, Real(-0.5)) : random.uniform(Real(0.5), 1);
      number = std::ldexp(mantissa, low + static_cast<int>(random.below(exponents)));
    }
  }

  /// Writes different values in each call. Bullet's penetration depth solver (EPA) alone has frames
  /// of 40 KB in double. AddressSanitizer would leave gaps around the array.
  JFPX_NO_COVERAGE [[gnu::noinline, gnu::no_sanitize_address]] void fill_stack() {
    start_ = (start_ + 977) % kCount;
    const Real* next = &numbers_[start_];
    volatile Real leftovers[kCount];
    for (volatile Real& number : leftovers) number = *next++;
  }

 private:
  static constexpr std::size_t kCount = 65536 / sizeof(Real);
  std::array<Real, 2 * kCount> numbers_{};
  std::size_t start_ = 0;
};
#undef JFPX_NO_COVERAGE
inline std::unique_ptr<StackResidue> g_stack_residue;

/// Fills the stack before each pair; once per dispatch is insufficient, because each pair leaves
/// its own values for the next. Fills it twice per pair: before the near callback, in whose frame
/// the algorithm runs, and after that callback has written its own values.
class ResidueDispatcher final : public btCollisionDispatcher {
 public:
  using btCollisionDispatcher::btCollisionDispatcher;
  bool needsCollision(const btCollisionObject* a, const btCollisionObject* b) override {
    g_stack_residue->fill_stack();
    return btCollisionDispatcher::needsCollision(a, b);
  }
  void dispatchAllCollisionPairs(btOverlappingPairCache* pairs, const btDispatcherInfo& info,
                                 btDispatcher* dispatcher) override {
    near_ = getNearCallback();
    setNearCallback(
        [](btBroadphasePair& pair, btCollisionDispatcher& self, const btDispatcherInfo& its_info) {
          g_stack_residue->fill_stack();
          static_cast<ResidueDispatcher&>(self).near_(pair, self, its_info);
        });
    btCollisionDispatcher::dispatchAllCollisionPairs(pairs, info, dispatcher);
    setNearCallback(near_);
  }
  static std::unique_ptr<btCollisionDispatcher> make(btCollisionConfiguration* configuration,
                                                     const RandomWorld&) {
    return std::make_unique<ResidueDispatcher>(configuration);
  }

 private:
  btNearCallback near_ = nullptr;
};

/// Fills the stack before and after each group.
struct ResidueSolver final : btSequentialImpulseConstraintSolver {
  btScalar solveGroup(btCollisionObject** bodies, int body_count, btPersistentManifold** manifolds,
                      int manifold_count, btTypedConstraint** constraints, int constraint_count,
                      const btContactSolverInfo& info, btIDebugDraw* debug_drawer,
                      btDispatcher* dispatcher) override {
    g_stack_residue->fill_stack();
    const btScalar result = btSequentialImpulseConstraintSolver::solveGroup(
        bodies, body_count, manifolds, manifold_count, constraints, constraint_count, info,
        debug_drawer, dispatcher);
    g_stack_residue->fill_stack();
    return result;
  }
  static WorldParts parts(const SolverWorld&) {
    WorldParts made;
    made.solver = [] { return std::make_unique<ResidueSolver>(); };
    return made;
  }
};

/// Whether stock differs, in this step or before, from stock with other values on the stack. In
/// most such worlds ordinary values make a difference; near a body at a distance of 10^10, only
/// huge values do; where stock's own leftovers act as any large value, only zeros do. One of ten to
/// thirty trials detects the nondeterminism.
inline bool stock_depends_on_residue(
    int step, const std::function<std::optional<Failure>()>& run_with_residue) {
  constexpr std::uint64_t kTrials = 100;
  constexpr int kHuge = std::numeric_limits<Real>::max_exponent;
  for (std::uint64_t seed = 0; seed < kTrials; ++seed) {
    if (seed == 0) {
      g_stack_residue = std::make_unique<StackResidue>();
    } else if (seed % 2 == 0) {
      g_stack_residue = std::make_unique<StackResidue>(kHuge - 1, kHuge, seed);
    } else {
      g_stack_residue = std::make_unique<StackResidue>(-10, 40, seed);
    }
    const auto failure = run_with_residue();
    if (failure && failure->step <= step) return true;
  }
  return false;
}

/// For a sphere and a capsule with the same centre, Bullet's own algorithm leaves the fourth
/// component of the normal uninitialized (reported by valgrind): two stock runs differ there.
inline bool is_uninitialized_by_stock(const Failure& failure) {
  return failure.what.find("m_normalWorldOnB.w") != std::string::npos;
}

/// Whether the failure is caused by Bullet itself: two stock worlds diverge no later, so that a
/// comparison with a third world is meaningless from then on.
inline bool is_stock_nondeterminism(const RandomWorld& world, const Failure& failure) {
  return is_uninitialized_by_stock(failure) || stock_depends_on_residue(failure.step, [&] {
           return run(world, nullptr, ResidueDispatcher::make);
         });
}
inline bool is_stock_nondeterminism(const SolverWorld& world, const Failure& failure) {
  return is_uninitialized_by_stock(failure) || stock_depends_on_residue(failure.step, [&] {
           return run(world, nullptr, ResidueSolver::parts, ResidueDispatcher::make);
         });
}

}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
