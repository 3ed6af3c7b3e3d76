/// Spheres to measure with: the gas that all figures refer to, and what breaks colliders.
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

/// gas (three contacts per sphere), polydisperse (radii over four decades, as many contacts),
/// clusters, line, plane, far (1e6 m from the origin), giant (one sphere over all others),
/// coincident (groups of 7 with one centre), outliers, overlap (all touch all).
std::span<const Input> inputs();
const Input& input(std::string_view name);

}  // namespace bench
}  // namespace JFPX_ABI
}  // namespace jfpx
