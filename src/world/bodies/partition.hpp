/// The partition of the movable bodies of a world into blocks of near bodies.
#pragma once

#include "src/base/thread_pool.hpp"
#include "src/contact_solver/soft_step/blocks.hpp"
#include "src/world/bodies/body_store.hpp"

#include <bit>
#include <cstdint>
#include <type_traits>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {

/// Rules of the partition, which are a function of the state of the world alone: the bodies in the
/// order of a Morton curve get the places 0, 1, 2, ... A body keeps its place until the partition
/// is renewed.
namespace partition {

/// The partition is renewed at the end of steps whose number is a multiple of this.
inline constexpr std::uint64_t kStepsPerRenewal = 64;
/// It is also renewed if more than one in this number of movable bodies has no place.
inline constexpr std::uint64_t kBodiesPerBodyWithoutPlace = 8;

/// Whether the partition of a world with several blocks is renewed at the end of a step, if a
/// movable body is awake then: the host skips the steps of worlds at rest.
/// @param steps         World::steps() before the step
/// @param movable       number of movable bodies
/// @param without_place number of movable bodies without a place
JFPX_HD constexpr bool is_due(std::uint64_t steps, std::uint32_t movable,
                              std::uint32_t without_place) {
  return steps % kStepsPerRenewal == 0 || without_place * kBodiesPerBodyWithoutPlace > movable;
}

/// An integer that is monotonic in the largest magnitude of the coordinates of a position.
using Magnitude = std::conditional_t<sizeof(Real) == 4, std::uint32_t, std::uint64_t>;
JFPX_HD constexpr Magnitude magnitude_of(const Vec3& position) {
  const auto magnitude = [](Real x) { return std::bit_cast<Magnitude>(x < 0 ? -x : x); };
  const Magnitude x = magnitude(position.x), y = magnitude(position.y), z = magnitude(position.z);
  const Magnitude larger = x < y ? y : x;
  return larger < z ? z : larger;
}

/// Cells of the Morton curve: a cube about the origin, divided into 2^21 cells along each axis. The
/// size of the cube is a power of two, so the order of two bodies does not change when a third one
/// enlarges the cube, except within a cell.
class Grid {
 public:
  /// @param largest maximum of magnitude_of()
  JFPX_HD explicit constexpr Grid(Magnitude largest) {
    constexpr int kDigits = sizeof(Real) == 4 ? 23 : 52, kBias = sizeof(Real) == 4 ? 127 : 1023;
    constexpr int kSmallest = -60;  // the scale of smaller cubes may overflow
    int exponent = static_cast<int>(largest >> kDigits) - kBias;
    if (exponent < kSmallest) exponent = kSmallest;
    // All magnitudes are below 2^(exponent + 1). The product with the scale is exact.
    const auto bits = static_cast<Magnitude>(kBias + kBits - 2 - exponent) << kDigits;
    scale_ = std::bit_cast<Real>(bits);
  }

  /// Morton code of the cell of a position.
  JFPX_HD constexpr std::uint64_t code(const Vec3& position) const {
    return spread(cell(position.x)) | spread(cell(position.y)) << 1 | spread(cell(position.z)) << 2;
  }

 private:
  static constexpr int kBits = 21;

  JFPX_HD constexpr std::uint32_t cell(Real x) const {
    const Real scaled = x * scale_;
    auto below = static_cast<std::int32_t>(scaled);
    if (static_cast<Real>(below) > scaled) --below;
    return static_cast<std::uint32_t>(below + (1 << (kBits - 1)));
  }
  /// The lowest kBits bits, spread to every third bit.
  JFPX_HD static constexpr std::uint64_t spread(std::uint64_t bits) {
    bits &= (std::uint64_t{1} << kBits) - 1;
    bits = (bits | bits << 32) & 0x001f00000000ffffu;
    bits = (bits | bits << 16) & 0x001f0000ff0000ffu;
    bits = (bits | bits << 8) & 0x100f00f00f00f00fu;
    bits = (bits | bits << 4) & 0x10c30c30c30c30c3u;
    return (bits | bits << 2) & 0x1249249249249249u;
  }

  Real scale_ = 1;  ///< [1/m]
};

}  // namespace partition

/// Renews the partition on the CPU. Its buffer grows and never shrinks.
class Partition {
 public:
  /// Reserves memory for update(). @throws std::bad_alloc
  void reserve(const BodyStore& bodies);
  /// Renews the places of the bodies at the end of a step if it is due.
  /// @param steps World::steps() before the step
  void update(BodyStore* bodies, std::uint64_t steps, ThreadPool* pool) noexcept;

 private:
  struct Entry {
    std::uint64_t code = 0;
    std::uint32_t body = 0;
    friend auto operator<=>(const Entry&, const Entry&) = default;
  };
  void sort(ThreadPool* pool) noexcept;

  std::vector<Entry> entries_;
};

}  // namespace JFPX_ABI
}  // namespace jfpx
