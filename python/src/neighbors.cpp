/// Binding of neighbor lists.
#include "python/src/bindings.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace python {
namespace {

/// The cells of vectors (3 C, 3) and flags (C, 3).
std::vector<TriclinicCell> to_triclinic(const Rows<const double>& vectors,
                                        const Rows<const bool>& repeats) {
  std::vector<TriclinicCell> cells(repeats.shape(0));
  for (std::size_t i = 0; i < cells.size(); ++i) {
    for (std::size_t k = 0; k < 3; ++k) {
      cells[i].repeats[k] = repeats(i, k);
      for (std::size_t axis = 0; axis < 3; ++axis) {
        cells[i].vectors[k][axis] = vectors(3 * i + k, axis);
      }
    }
  }
  return cells;
}

/// Indices of first and second points, shifts, distances and vectors as rows.
/// @param species contiguous, like the radii and the cutoffs
/// @param offsets of systems; without, all points are one
/// @param vectors of the cells of the systems, if `cell_of_each`, or of one cell
nb::tuple find(const Rows<const Real>& positions, double cutoff,
               const std::optional<Vector<const std::uint64_t>>& offsets,
               const std::optional<Rows<const double>>& vectors, const Rows<const bool>& repeats,
               bool cell_of_each, const std::optional<Vector<const Real>>& radii,
               const std::optional<Vector<const std::uint32_t>>& species,
               const std::optional<Rows<const Real>>& species_cutoffs, bool both_orders,
               double least_distance, const std::array<bool, 2>& columns, unsigned threads) {
  NeighborOptions options{.both_orders = both_orders,
                          .least_distance = static_cast<Real>(least_distance),
                          .distances = columns[0],
                          .vectors = columns[1],
                          .threads = threads};
  if (radii) options.radii = std::span(radii->data(), radii->size());
  if (species) options.species = std::span(species->data(), species->size());
  if (species_cutoffs) {
    options.species_cutoffs = std::span(species_cutoffs->data(), species_cutoffs->size());
  }
  std::vector<TriclinicCell> cells;
  if (vectors) cells = to_triclinic(*vectors, repeats);
  if (vectors && !cell_of_each) {
    options.cell = cells.at(0);
    cells.clear();
  }
  Neighbors found;
  {
    const nb::gil_scoped_release release;
    const SignalInterrupt interrupt;
    const std::vector<Vec3> points = to_points(positions);
    const auto limit = static_cast<Real>(cutoff);
    if (offsets) {
      std::vector<std::uint64_t> begins(offsets->shape(0));
      for (std::size_t i = 0; i < begins.size(); ++i) begins[i] = (*offsets)(i);
      found = find_neighbors_in_systems(points, begins, cells, limit, options);
    } else {
      found = find_neighbors(points, limit, options);
    }
  }
  return nb::make_tuple(own<std::uint32_t>(std::move(found.first)),
                        own<std::uint32_t>(std::move(found.second)),
                        own<std::int32_t>(std::move(found.shifts)),
                        own<Real>(std::move(found.distances)), own<Real>(std::move(found.vectors)));
}

}  // namespace

void bind_neighbors(nb::module_& module) {
  module.def("find_neighbors", find, nb::arg("positions"), nb::arg("cutoff"),
             nb::arg("offsets").none(), nb::arg("vectors").none(), nb::arg("repeats"),
             nb::arg("cell_of_each"), nb::arg("radii").none(), nb::arg("species").none(),
             nb::arg("species_cutoffs").none(), nb::arg("both_orders"), nb::arg("least_distance"),
             nb::arg("columns"), nb::arg("threads"));
}

}  // namespace python
}  // namespace JFPX_ABI
}  // namespace jfpx
