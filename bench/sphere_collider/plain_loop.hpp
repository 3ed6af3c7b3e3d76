/// Reference of the sphere benchmarks.
#pragma once

#include <jfpx/contact.hpp>

#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {

/// Tests every pair a < b with detail::test_sphere_pair(), compiled with -O2 and without vectors.
void plain_loop(std::span<const SphereInstance> spheres, std::vector<SphereContact>* contacts);

}  // namespace JFPX_ABI
}  // namespace jfpx
