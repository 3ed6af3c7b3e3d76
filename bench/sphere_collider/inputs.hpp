/// Inputs of the sphere benchmarks: a gas, which is the reference, and inputs that are difficult
/// for broad phases.
#pragma once

#include <jfpx/contact.hpp>

#include <span>
#include <string_view>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace bench {

struct Input {
  std::string_view name;
  std::vector<SphereInstance> (*make)(std::size_t n);
};

/// gas (three contacts per sphere), crowded (fifteen), polydisperse (radii over four decades, as
/// many contacts as gas), clusters, line, plane, far (1e6 m from the origin), giant (one sphere
/// contains all others), coincident (groups of 7 concentric spheres), outliers, overlap (all pairs
/// touch).
std::span<const Input> inputs();
const Input& input(std::string_view name);

}  // namespace bench
}  // namespace JFPX_ABI
}  // namespace jfpx
