/// The collider alone: spheres in, touching pairs out.
#include <jfpx/sphere_collider.hpp>

#include <cstdio>
#include <vector>

int main() {
  auto collider = jfpx::make_sphere_collider();
  std::vector<jfpx::SphereInstance> spheres = {{{0, 0, 0}, 1}, {{1.5, 0, 0}, 1}, {{0, 3, 0}, 1}};
  for (const jfpx::SphereContact& c : collider->find_contacts(spheres)) {
    // spheres c.a < c.b touch; c.normal points from b to a, c.distance <= 0
    std::printf("spheres %u and %u overlap by %g\n", c.a, c.b, static_cast<double>(-c.distance));
  }
}
