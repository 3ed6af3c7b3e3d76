/// Generator of numbers and choices from the input bytes of a fuzzer, with the interface of Random.
#pragma once

#include <jfpx/random.hpp>

#include <array>
#include <cstdint>
#include <limits>
#include <span>

namespace jfpx {
inline namespace JFPX_ABI {
namespace test {

/// Each draw consumes one or two bytes, so that a mutation of one byte changes one choice. After
/// the last byte, the numbers are a fixed pseudo-random sequence.
class Bytes {
 public:
  explicit Bytes(std::span<const std::uint8_t> bytes) : bytes_(bytes) {}

  bool used_up() const { return bytes_.empty(); }

  /// 16 random bits.
  std::uint64_t next() {
    const std::uint64_t low = next_byte();
    return low | next_byte() << 8;
  }
  /// In [0, 1), on a grid of 2^-16.
  Real uniform() { return static_cast<Real>(next()) * static_cast<Real>(1.0 / 65536.0); }
  Real uniform(Real low, Real high) { return low + (high - low) * uniform(); }
  Vec3 uniform_in_box(const Vec3& low, const Vec3& high) {
    const Real x = uniform(low.x, high.x);
    const Real y = uniform(low.y, high.y);
    const Real z = uniform(low.z, high.z);
    return {x, y, z};
  }
  /// In [0, n), 0 < n <= 65536.
  std::uint64_t below(std::uint64_t n) { return (n <= 256 ? next_byte() : next()) % n; }
  bool chance(Real share) { return static_cast<Real>(next_byte()) < 256 * share; }

  /// A number that is mostly in [low, high), occasionally a valid or invalid edge case.
  Real number(Real low, Real high) {
    using Limits = std::numeric_limits<Real>;
    constexpr std::array<Real, 24> kEdgeCases{
        0,
        Real(-0.0),
        1,
        -1,
        Limits::denorm_min(),
        Limits::min(),
        -Limits::min(),
        Limits::epsilon(),
        Limits::max(),
        Limits::lowest(),
        Limits::infinity(),
        -Limits::infinity(),
        Limits::quiet_NaN(),
        Real(1e9),
        Real(-1e9),
        Real(1.0001e9),
        Real(16777216),
        Real(1e-9),
        Real(1e-20),
        Real(1e20),
        Real(1e-4),
        Real(1e4),
        1 + Limits::epsilon(),
        Real(0.5),
    };
    const std::uint64_t kind = next_byte();
    if (kind < kEdgeCases.size()) return kEdgeCases[kind];
    const std::uint64_t fraction = kind << 8 | next_byte();
    return low + (high - low) * (static_cast<Real>(fraction) * static_cast<Real>(1.0 / 65536.0));
  }
  Vec3 vector(Real low, Real high) {
    const Real x = number(low, high);
    const Real y = number(low, high);
    const Real z = number(low, high);
    return {x, y, z};
  }

 private:
  std::uint64_t next_byte() {
    if (bytes_.empty()) return padding_.next() >> 56;
    const std::uint8_t byte = bytes_.front();
    bytes_ = bytes_.subspan(1);
    return byte;
  }

  std::span<const std::uint8_t> bytes_;
  Random padding_{0};
};

}  // namespace test
}  // namespace JFPX_ABI
}  // namespace jfpx
