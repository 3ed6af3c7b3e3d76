/// Colors of contacts, for the CPU and for devices.
#pragma once

#include "src/contact_solver/soft_step/contact_set.hpp"

#include <bit>
#include <cstdint>

namespace jfpx {
inline namespace JFPX_ABI {
namespace soft_step {

/// Number of colors of a class. The classes are inner rows and crossing rows (see blocks.hpp).
inline constexpr std::uint8_t kColorsPerClass = 64;
/// Colors of inner rows are the numbers below kColorsPerClass. Those of crossing rows start here,
/// so that the colors of worlds without crossing rows are those of earlier versions in snapshots.
inline constexpr std::uint8_t kFirstCrossingColor = 128;
/// Color of contacts without a free color, which are solved serially.
inline constexpr std::uint8_t kOverflowColor = kColorsPerClass;
/// Color of a contact with an immovable or kinematic body, which needs no color.
inline constexpr std::uint8_t kFixedColor = 254;
/// Color of a contact that has not been colored.
inline constexpr std::uint8_t kNoColor = 255;

/// Finalizer of SplitMix64 (Steele, Lea and Flood 2014).
JFPX_HD constexpr std::uint64_t mixed(std::uint64_t x) {
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9u;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebu;
  return x ^ (x >> 31);
}

/// Position of a contact in the order of coloring; ties are ordered by number of contact.
JFPX_HD constexpr std::uint64_t color_order(const ContactKey& key) {
  const std::uint64_t bodies = std::uint64_t{key.a} << 32 | key.b;
  const std::uint64_t parts = std::uint64_t{key.part_a} << 32 | key.part_b;
  return mixed(mixed(bodies + 0x9e3779b97f4a7c15u) ^ parts);
}

/// Whether a color is one of inner rows.
JFPX_HD constexpr bool is_inner_color(std::uint32_t color) { return color < kColorsPerClass; }
/// Whether a color is one of inner or crossing rows.
JFPX_HD constexpr bool is_color(std::uint32_t color) {
  return is_inner_color(color) ||
         (color >= kFirstCrossingColor && color < kFirstCrossingColor + kColorsPerClass);
}
/// Number in its class of a color for which is_color() holds.
JFPX_HD constexpr std::uint32_t number_in_class(std::uint32_t color) {
  static_assert(kFirstCrossingColor % kColorsPerClass == 0);
  return color % kColorsPerClass;
}

/// The colors of a body: a set of numbers for each class.
struct alignas(16) UsedColors {
  std::uint64_t inner = 0, crossing = 0;

  JFPX_HD constexpr std::uint64_t& of_class(bool is_inner) { return is_inner ? inner : crossing; }
};

/// The lowest number that is not in a set of numbers; kColorsPerClass if all are.
JFPX_HD inline std::uint32_t lowest_free(std::uint64_t used) {
  static_assert(kColorsPerClass == 64);
#if defined(__CUDA_ARCH__)
  return static_cast<std::uint32_t>(__popcll(used & ~(used + 1)));
#else
  return static_cast<std::uint32_t>(std::countr_one(used));
#endif
}

/// Adds the lowest color of a class that two bodies do not have to both of them. @returns the
/// color, or kOverflowColor if there is none
JFPX_HD inline std::uint8_t take_lowest_color(bool is_inner, UsedColors* of_a, UsedColors* of_b) {
  std::uint64_t &a = of_a->of_class(is_inner), &b = of_b->of_class(is_inner);
  const std::uint32_t number = lowest_free(a | b);
  if (number == kColorsPerClass) return kOverflowColor;
  a |= std::uint64_t{1} << number;
  b |= std::uint64_t{1} << number;
  return static_cast<std::uint8_t>(is_inner ? number : kFirstCrossingColor + number);
}

/// Whether a contact keeps the color of the last step: it has one, and it is of the same class.
JFPX_HD constexpr bool keeps_color(std::uint32_t color, bool is_inner) {
  return is_color(color) && is_inner_color(color) == is_inner;
}

}  // namespace soft_step
}  // namespace JFPX_ABI
}  // namespace jfpx
