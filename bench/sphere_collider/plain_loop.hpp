/// The yardstick of the sphere benchmarks.
#pragma once

#include <jfpx/contact.hpp>

#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {

/// Every pair a < b through the shared arithmetic: what a compiler makes of it at -O2, without
/// vectors.
void plain_loop(std::span<const SphereInstance> spheres, std::vector<SphereContact>* contacts);

}  // namespace JFPX_ABI
}  // namespace jfpx
