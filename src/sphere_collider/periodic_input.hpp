/// Validation of periodic cells, with the same messages for all backends.
#pragma once

#include "src/sphere_collider/periodic_cell.hpp"
#include "src/sphere_collider/sphere_input.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace detail {

inline Real largest_radius(std::span<const SphereInstance> spheres) {
  Real radius = 0;
  for (const SphereInstance& s : spheres) radius = std::max(radius, s.radius);
  return radius;
}

/// @throws InvalidArgument for a length that is not in the range of is_length(), or less than four
///   times the largest radius
inline void check_cell(const PeriodicCell& cell, Real largest_radius, const std::string& system) {
  for (int k = 0; k < 3; ++k) {
    const Real length = cell.lengths[k];
    const std::string name =
        system + "periodic length " + "xyz"[k] + " is " + to_text(length) + "; it must be ";
    if (!cell.repeats[static_cast<std::size_t>(k)]) continue;
    if (!is_length(length)) {
      throw InvalidArgument(name + "> 0 and at most " + to_text(kLongestPeriod));
    }
    if (!(largest_radius <= length / 4)) {
      throw InvalidArgument(name + "at least twice the cutoff, which is " +
                            to_text(2 * largest_radius));
    }
  }
}

/// Checks the cell of spheres `first`, `first` + 1, ... of a list.
/// @param system begins messages about the cell
/// @throws InvalidArgument as check_cell(), and for a sphere whose centre is not reducible
inline void check_in_cell(const PeriodicCell& cell, std::span<const SphereInstance> spheres,
                          std::size_t first = 0, const std::string& system = "") {
  check_cell(cell, largest_radius(spheres), system);
  for (std::size_t i = 0; i < spheres.size(); ++i) {
    for (int k = 0; k < 3; ++k) {
      const Real x = spheres[i].centre[k];
      if (!cell.repeats[static_cast<std::size_t>(k)] || is_reducible(x, cell.lengths[k])) continue;
      throw InvalidArgument("sphere " + std::to_string(first + i) + ": centre." + "xyz"[k] +
                            " is " + to_text(x) + "; it must be within 2^20 periodic lengths");
    }
  }
}

/// @throws InvalidArgument unless there is a cell for each system
inline void check_number_of_cells(std::size_t cells, std::span<const std::uint64_t> offsets) {
  if (cells + 1 == offsets.size()) return;
  throw InvalidArgument("there are " + std::to_string(cells) +
                        " periodic cells; there must be one for each of " +
                        std::to_string(offsets.size() - 1) + " systems");
}

/// The same as check_in_cell() for each system.
inline void check_in_cells(std::span<const PeriodicCell> cells,
                           std::span<const SphereInstance> spheres,
                           std::span<const std::uint64_t> offsets) {
  for (std::size_t i = 0; i < cells.size(); ++i) {
    check_in_cell(cells[i], spheres.subspan(offsets[i], offsets[i + 1] - offsets[i]), offsets[i],
                  "system " + std::to_string(i) + ": ");
  }
}

}  // namespace detail
}  // namespace JFPX_ABI
}  // namespace jfpx
