/// Validation of periodic cells, with the same messages for all backends.
#pragma once

#include "src/sphere_collider/periodic_cell.hpp"
#include "src/sphere_collider/sphere_input.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace detail {

/// @throws InvalidArgument for a length that is not finite and > 0, or less than four times the
///   largest radius
inline void check_cell(const PeriodicCell& cell, Real largest_radius) {
  for (int k = 0; k < 3; ++k) {
    const Real length = cell.lengths[k];
    const std::string name = std::string("periodic length ") + "xyz"[k] + " is ";
    if (!cell.repeats[static_cast<std::size_t>(k)]) continue;
    if (!is_finite(length) || !(length > 0)) {
      throw InvalidArgument(name + to_text(length) + "; it must be finite and > 0");
    }
    if (!(largest_radius <= length / 4)) {
      throw InvalidArgument(name + to_text(length) +
                            "; it must be at least twice the cutoff, which is " +
                            to_text(2 * largest_radius));
    }
  }
}

/// @throws InvalidArgument for a sphere whose centre is not reducible
[[noreturn]] inline void reject_far(std::size_t sphere, const Vec3& centre,
                                    const PeriodicCell& cell) {
  int k = 0;
  while (k < 2 &&
         (!cell.repeats[static_cast<std::size_t>(k)] || is_reducible(centre[k], cell.lengths[k]))) {
    ++k;
  }
  throw InvalidArgument("sphere " + std::to_string(sphere) + ": centre." + "xyz"[k] + " is " +
                        to_text(centre[k]) + "; it must be within 2^20 periodic lengths");
}

}  // namespace detail

}  // namespace JFPX_ABI
}  // namespace jfpx
