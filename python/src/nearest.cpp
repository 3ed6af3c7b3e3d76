/// Binding of the search for nearest points.
#include "python/src/bindings.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace python {
namespace {

/// Writes the rows of the result, k long, to arrays of their size.
template <class Index>
void write_nearest(const Rows<const Real>& positions, const std::optional<Rows<const Real>>& query,
                   std::size_t k, const std::optional<Rows<const double>>& cell, unsigned threads,
                   const Rows<Index>& indices, const Rows<Real>& distances,
                   const std::optional<Rows<std::int32_t>>& shifts) {
  NearestOptions options{.cell = {}, .threads = threads};
  if (cell) options.cell = to_cells(*cell).at(0);
  const std::vector<Vec3> points = to_points(positions);
  const NearestPoints found = query ? find_nearest(points, to_points(*query), k, options)
                                    : find_nearest(points, k, options);
  for_each_interruptible(found.indices.size(), [&](std::size_t i) {
    indices(i / k, i % k) = static_cast<Index>(found.indices[i]);
    distances(i / k, i % k) = found.distances[i];
    for (std::size_t axis = 0; shifts && axis < 3; ++axis) {
      (*shifts)(i, axis) = found.shifts[i][axis];
    }
  });
}

template <class Index>
void bind_with(nb::module_& module) {
  module.def("write_nearest", write_nearest<Index>, nb::arg("positions"), nb::arg("query").none(),
             nb::arg("k"), nb::arg("cell").none(), nb::arg("threads"),
             nb::arg("indices").noconvert(), nb::arg("distances").noconvert(),
             nb::arg("shifts").noconvert().none(),
             nb::call_guard<nb::gil_scoped_release, SignalInterrupt>());
}

}  // namespace

void bind_nearest(nb::module_& module) {
  bind_with<std::int32_t>(module);
  bind_with<std::int64_t>(module);
}

}  // namespace python
}  // namespace JFPX_ABI
}  // namespace jfpx
