/// Portable random number generator. Unlike the standard distributions, it produces the same
/// numbers for a seed on every machine, compiler and precision.
#pragma once

#include <jfpx/math.hpp>

#include <cstdint>

namespace jfpx {
inline namespace JFPX_ABI {

/// splitmix64 (Steele, Lea, Flood 2014): 64 bits of state, passes BigCrush. Not suitable for
/// cryptography.
class Random {
 public:
  explicit constexpr Random(std::uint64_t seed) : state_(seed) {}

  /// Returns 64 random bits.
  constexpr std::uint64_t next() {
    std::uint64_t z = (state_ += 0x9e3779b97f4a7c15u);
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
    return z ^ (z >> 31);
  }
  /// Returns one of 2^24 evenly spaced values in [0, 1), which are exact in float, so that float
  /// and double agree.
  constexpr Real uniform() {
    return static_cast<Real>(next() >> 40) * static_cast<Real>(1.0 / 16777216.0);
  }
  /// Returns a value in [low, high).
  constexpr Real uniform(Real low, Real high) { return low + (high - low) * uniform(); }
  /// Returns a point in the box [low, high).
  constexpr Vec3 uniform_in_box(const Vec3& low, const Vec3& high) {
    const Real x = uniform(low.x, high.x);
    const Real y = uniform(low.y, high.y);
    const Real z = uniform(low.z, high.z);
    return {x, y, z};
  }
  /// Returns an integer in [0, n), n > 0, with a bias below n / 2^64.
  constexpr std::uint64_t below(std::uint64_t n) { return next() % n; }

 private:
  std::uint64_t state_;
};

}  // namespace JFPX_ABI
}  // namespace jfpx
