/// The largest distances of neighbors, by pair.
#pragma once

#include <jfpx/neighbors.hpp>

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace cpu {

class NeighborCutoffs {
 public:
  /// @param options must outlive the object
  /// @throws InvalidArgument as find_neighbors() for cutoffs and the least distance
  NeighborCutoffs(std::size_t points, Real cutoff, const NeighborOptions& options);

  /// Whether pairs have different ones.
  bool differ() const { return radii_ || !matrix_.empty(); }
  /// No pair has a larger one; > 0.
  Real largest() const { return largest_; }
  /// No pair of this point has a larger one.
  Real largest_of(std::size_t point) const {
    if (radii_) return ((*radii_)[point] + largest_radius_) + cutoff_;
    if (!matrix_.empty()) return largest_of_species_[species_[point]];
    return cutoff_;
  }
  Real least() const { return least_; }

  bool has(std::size_t a, std::size_t b, Real distance) const {
    return distance <= of(a, b) && distance >= least_ && of(a, b) > 0;
  }

 private:
  Real of(std::size_t a, std::size_t b) const {
    if (radii_) return ((*radii_)[a] + (*radii_)[b]) + cutoff_;
    if (!matrix_.empty()) return of_species(species_[a], species_[b]);
    return cutoff_;
  }
  Real of_species(std::size_t a, std::size_t b) const {
    const Real cutoff = matrix_[a * largest_of_species_.size() + b];
    return cutoff > 0 ? cutoff + cutoff_ : 0;
  }
  void set_radii(std::size_t points);
  void set_species(std::size_t points);

  Real cutoff_, least_;
  std::optional<std::span<const Real>> radii_;
  std::span<const Real> matrix_;
  std::span<const std::uint32_t> species_;
  std::vector<Real> largest_of_species_;
  Real largest_radius_ = 0, largest_ = 0;
};

}  // namespace cpu
}  // namespace JFPX_ABI
}  // namespace jfpx
