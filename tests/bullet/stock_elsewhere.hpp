/// Stock Bullet with other leftovers on the stack, to tell its own irreproducible worlds from our
/// errors: in rare worlds Bullet 3.24 reads uninitialised memory of its stack, for example in
/// btPersistentManifold::refreshContactPoints (world 50183557 in float, seen by valgrind in a stock
/// world), and two stock worlds part ways.
#pragma once

#include "tests/bullet/solver_world.hpp"

#include <array>
#include <cmath>
#include <limits>

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {

/// What g_leftovers leaves on the stack for those who read it uninitialised. Numbers that differ
/// from each other: where all are the same, their differences are 0.
class Leftovers {
 public:
  /// Of any sign, with exponents of two in [low, high].
  Leftovers(int low, int high, std::uint64_t seed) {
    Random random(seed);
    const auto exponents = static_cast<std::uint64_t>(high - low + 1);
    for (Real& number : numbers_) {
      const Real mantissa =
          random.below(2) == 0 ? random.uniform(-1, Real(-0.5)) : random.uniform(Real(0.5), 1);
      number = std::ldexp(mantissa, low + static_cast<int>(random.below(exponents)));
    }
  }

  /// Other ones each time. Bullet's penetration depth solver (EPA) alone has frames of 40 KB in
  /// double. AddressSanitizer would leave gaps around the array.
  [[gnu::noinline, gnu::no_sanitize_address]] void fill_stack() {
    start_ = (start_ + 977) % kCount;
    const Real* next = &numbers_[start_];
    volatile Real leftovers[kCount];
    for (volatile Real& number : leftovers) number = *next++;
  }

 private:
  static constexpr std::size_t kCount = 65536 / sizeof(Real);
  std::array<Real, 2 * kCount> numbers_;
  std::size_t start_ = 0;
};
inline std::unique_ptr<Leftovers> g_leftovers;

/// Leftovers before each pair. Once a dispatch is not enough: what a pair finds there is left by
/// the pair before. Twice a pair: before the near callback, whose frame the algorithm's will be
/// in, and behind what that callback itself has left.
class DispatcherElsewhere final : public btCollisionDispatcher {
 public:
  using btCollisionDispatcher::btCollisionDispatcher;
  bool needsCollision(const btCollisionObject* a, const btCollisionObject* b) override {
    g_leftovers->fill_stack();
    return btCollisionDispatcher::needsCollision(a, b);
  }
  void dispatchAllCollisionPairs(btOverlappingPairCache* pairs, const btDispatcherInfo& info,
                                 btDispatcher* dispatcher) override {
    near_ = getNearCallback();
    setNearCallback(
        [](btBroadphasePair& pair, btCollisionDispatcher& self, const btDispatcherInfo& its_info) {
          g_leftovers->fill_stack();
          static_cast<DispatcherElsewhere&>(self).near_(pair, self, its_info);
        });
    btCollisionDispatcher::dispatchAllCollisionPairs(pairs, info, dispatcher);
    setNearCallback(near_);
  }
  static std::unique_ptr<btCollisionDispatcher> make(btCollisionConfiguration* configuration,
                                                     const RandomWorld&) {
    return std::make_unique<DispatcherElsewhere>(configuration);
  }

 private:
  btNearCallback near_ = nullptr;
};

/// Leftovers before and after each group.
struct SolverElsewhere final : btSequentialImpulseConstraintSolver {
  btScalar solveGroup(btCollisionObject** bodies, int body_count, btPersistentManifold** manifolds,
                      int manifold_count, btTypedConstraint** constraints, int constraint_count,
                      const btContactSolverInfo& info, btIDebugDraw* debug_drawer,
                      btDispatcher* dispatcher) override {
    g_leftovers->fill_stack();
    const btScalar result = btSequentialImpulseConstraintSolver::solveGroup(
        bodies, body_count, manifolds, manifold_count, constraints, constraint_count, info,
        debug_drawer, dispatcher);
    g_leftovers->fill_stack();
    return result;
  }
  static WorldParts parts(const SolverWorld&) {
    WorldParts made;
    made.solver = [] { return std::make_unique<SolverElsewhere>(); };
    return made;
  }
};

/// Whether stock differs, in this step or before, from stock with some other leftovers. Ordinary
/// numbers make a difference in most such worlds; beside a body that has been thrown to 10^10, only
/// huge ones do. One trial of ten to thirty finds what is there.
inline bool stock_parts_from_stock(int step,
                                   const std::function<std::optional<Failure>()>& run_elsewhere) {
  constexpr std::uint64_t kTrials = 100;
  constexpr int kHuge = std::numeric_limits<Real>::max_exponent;
  for (std::uint64_t seed = 0; seed < kTrials; ++seed) {
    g_leftovers = seed % 2 == 0 ? std::make_unique<Leftovers>(kHuge - 1, kHuge, seed)
                                : std::make_unique<Leftovers>(-10, 40, seed);
    const auto failure = run_elsewhere();
    if (failure && failure->step <= step) return true;
  }
  return false;
}

/// Of a sphere and a capsule about the same centre, Bullet's own algorithm leaves the fourth number
/// of the normal unset (seen by valgrind): two runs of one stock world differ there.
inline bool is_left_unset_by_stock(const Failure& failure) {
  return failure.what.find("m_normalWorldOnB.w") != std::string::npos;
}

/// Whether the failure is Bullet's own: stock has parted ways with stock no later, and from then on
/// nothing can be said of a third.
inline bool is_accident_of_stock(const RandomWorld& world, const Failure& failure) {
  return is_left_unset_by_stock(failure) || stock_parts_from_stock(failure.step, [&] {
           return run(world, nullptr, DispatcherElsewhere::make);
         });
}
inline bool is_accident_of_stock(const SolverWorld& world, const Failure& failure) {
  return is_left_unset_by_stock(failure) || stock_parts_from_stock(failure.step, [&] {
           return run(world, nullptr, SolverElsewhere::parts, DispatcherElsewhere::make);
         });
}

}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
