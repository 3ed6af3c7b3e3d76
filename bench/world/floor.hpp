/// Lower bounds of the cost of a step's stages: bytes that must be read and written once, and
/// operations of the formulas, at the measured rates of one core.
#pragma once

#include <jfpx/world.hpp>

#include <benchmark/benchmark.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cstring>
#include <limits>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace bench {

struct Work {
  double bytes = 0, operations = 0;
};

/// Per awake body: 13 numbers of the state read and written, 3 of the acceleration read. Velocity 9
/// operations, angular velocity 3, position 6, orientation 49 (a product of quaternions 28, half a
/// step added 8, normalised 13), mean motion 15.
inline Work integrate_work(double awake) { return {awake * 29 * sizeof(Real), awake * 82}; }

/// Spheres read, contacts written. The formula of a contact has 16 operations: a difference of
/// centres 3, its length 6, radii 1, distance 1, reciprocal 1, normal 3, comparison 1. Pairs that
/// do not touch cost nothing.
inline Work detect_work(double spheres, double contacts) {
  return {spheres * sizeof(SphereInstance) + contacts * sizeof(SphereContact), contacts * 16};
}

/// Contacts read, velocities of the bodies read and written. Per iteration: a projection has 270
/// operations (inverse effective masses 68, projections 120, displacements 82), an impulse 456
/// (axes 15, velocity 42, responses 258, impulse 60, transformation 15, velocity changes 66),
/// without the updates of neighboring contacts.
inline Work resolve_work(const StepReport& report, double bodies) {
  return {static_cast<double>(report.contacts) * sizeof(Contact) + bodies * 12 * sizeof(Real),
          static_cast<double>(report.position_iterations) * 270 +
              static_cast<double>(report.velocity_iterations) * 456};
}

/// The best rate of several rounds, per second.
template <class Round>
double best_rate(double units, const Round& round) {
  double least = std::numeric_limits<double>::infinity();
  for (int i = 0; i < 7; ++i) {
    const auto start = std::chrono::steady_clock::now();
    round();
    const std::chrono::duration<double> taken = std::chrono::steady_clock::now() - start;
    least = std::min(least, taken.count());
  }
  return units / least;
}

/// [GB/s] read and written by one core, in copies larger than its caches.
inline double copied_gb_a_second() {
  const std::vector<char> from(std::size_t{64} << 20, 1);
  std::vector<char> to(from.size());
  return best_rate(2e-9 * static_cast<double>(from.size()), [&] {
    std::memcpy(to.data(), from.data(), from.size());
    benchmark::DoNotOptimize(to.data());
    benchmark::ClobberMemory();
  });
}

/// [1e9/s] additions and multiplications of one core, with the vectors of baseline x86-64.
inline double giga_operations_a_second() {
  constexpr int kRepeats = 200000;
  std::array<Real, 64> x;
  for (std::size_t i = 0; i < x.size(); ++i) x[i] = static_cast<Real>(i);
  return best_rate(2e-9 * kRepeats * static_cast<double>(x.size()), [&] {
    for (int n = 0; n < kRepeats; ++n) {
      for (Real& value : x) value = value * Real(0.5) + Real(1);
      benchmark::DoNotOptimize(x);
    }
  });
}

}  // namespace bench
}  // namespace JFPX_ABI
}  // namespace jfpx
