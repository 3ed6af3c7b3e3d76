/// The reference loop. Always compiled with -O2, see benches.cmake.
#include "bench/sphere_collider/plain_loop.hpp"

#include "src/collide/sphere_pair.hpp"

namespace jfpx {
inline namespace JFPX_ABI {

void plain_loop(std::span<const SphereInstance> spheres, std::vector<SphereContact>* contacts) {
  contacts->clear();
  const auto n = static_cast<SphereIndex>(spheres.size());
  for (SphereIndex a = 0; a < n; ++a) {
    for (SphereIndex b = a + 1; b < n; ++b) {
      const PairResult r = detail::test_sphere_pair(spheres[a], spheres[b]);
      if (r.touching != 0) contacts->push_back({a, b, r.normal, r.distance});
    }
  }
}

}  // namespace JFPX_ABI
}  // namespace jfpx
