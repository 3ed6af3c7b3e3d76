/// Validation of the cutoffs of neighbor lists.
#include "src/sphere_collider/cpu/neighbor_cutoffs.hpp"

#include <jfpx/error.hpp>

#include "src/sphere_collider/sphere_input.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

namespace jfpx {
inline namespace JFPX_ABI {
namespace cpu {
namespace {

/// Squares of distances in this range are exact to the precision of Real.
Real least_cutoff() { return std::sqrt(std::numeric_limits<Real>::min() / kEpsilon); }
Real greatest_cutoff() { return std::sqrt(std::numeric_limits<Real>::max()); }

/// @throws InvalidArgument unless the value is in the range, or 0 where that is allowed
template <class Name>
void check_cutoff(Real value, Real greatest, bool may_be_zero, const Name& name) {
  if (value >= least_cutoff() && value <= greatest) return;
  if (may_be_zero && value == 0) return;
  throw InvalidArgument(name() + " is " + detail::to_text(value) + "; it must be " +
                        (may_be_zero ? "0, or " : "") + "from " + detail::to_text(least_cutoff()) +
                        " to " + detail::to_text(greatest) + ", so that its square is exact");
}

void check_size(const char* name, std::size_t size, std::size_t points) {
  if (size == points) return;
  throw InvalidArgument("there are " + std::to_string(size) + " " + name +
                        "; there must be one for each of " + std::to_string(points) + " points");
}

}  // namespace

NeighborCutoffs::NeighborCutoffs(std::size_t points, Real cutoff, const NeighborOptions& options)
    : cutoff_(cutoff),
      least_(options.least_distance),
      radii_(options.radii),
      matrix_(options.species_cutoffs),
      species_(options.species) {
  if (radii_ && !(matrix_.empty() && species_.empty())) {
    throw InvalidArgument("radii and cutoffs of species exclude each other");
  }
  check_cutoff(cutoff, greatest_cutoff(), differ(), [] { return std::string("cutoff"); });
  largest_ = cutoff;
  if (radii_) set_radii(points);
  if (!matrix_.empty() || !species_.empty()) set_species(points);
  if (!(least_ == 0 || (least_ >= least_cutoff() && least_ <= largest_))) {
    throw InvalidArgument("least distance is " + detail::to_text(least_) +
                          "; it must be 0, or from " + detail::to_text(least_cutoff()) +
                          " to the cutoff");
  }
  largest_ = std::max(largest_, least_cutoff());
}

void NeighborCutoffs::set_radii(std::size_t points) {
  const std::span<const Real> radii = *radii_;
  check_size("radii", radii.size(), points);
  for (std::size_t i = 0; i < points; ++i) {
    check_cutoff(radii[i], greatest_cutoff() / 4, true,
                 [&] { return "radius " + std::to_string(i); });
    largest_radius_ = std::max(largest_radius_, radii[i]);
  }
  largest_ = (largest_radius_ + largest_radius_) + cutoff_;
  check_cutoff(largest_, greatest_cutoff(), true,
               [] { return std::string("the sum of the largest radii and the cutoff"); });
}

void NeighborCutoffs::set_species(std::size_t points) {
  const auto number =
      static_cast<std::size_t>(std::sqrt(static_cast<double>(matrix_.size())) + 0.5);
  if (number * number != matrix_.size()) {
    throw InvalidArgument("there are " + std::to_string(matrix_.size()) +
                          " cutoffs of species; they must be a square matrix");
  }
  check_size("species", species_.size(), points);
  largest_of_species_.assign(number, 0);
  for (std::size_t a = 0; a < number; ++a) {
    for (std::size_t b = 0; b < number; ++b) {
      const auto name = [&] {
        return "cutoff of species " + std::to_string(a) + " and " + std::to_string(b);
      };
      const Real given = matrix_[a * number + b];
      check_cutoff(given, greatest_cutoff() / 2, true, name);
      if (given != matrix_[b * number + a]) {
        throw InvalidArgument(
            name() + " is " + detail::to_text(given) + ", and in the other order " +
            detail::to_text(matrix_[b * number + a]) + "; the matrix must be symmetric");
      }
      largest_of_species_[a] = std::max(largest_of_species_[a], of_species(a, b));
    }
    largest_ = std::max(largest_, largest_of_species_[a]);
  }
  check_cutoff(largest_, greatest_cutoff(), true, [] {
    return std::string("the sum of the largest cutoff of species and the cutoff");
  });
  for (std::size_t i = 0; i < points; ++i) {
    if (species_[i] < number) continue;
    throw InvalidArgument("species " + std::to_string(i) + " is " + std::to_string(species_[i]) +
                          "; it must be less than the number of species, " +
                          std::to_string(number));
  }
}

}  // namespace cpu
}  // namespace JFPX_ABI
}  // namespace jfpx
