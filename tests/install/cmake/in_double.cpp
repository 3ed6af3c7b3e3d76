/// The part of the program that computes in double.
#include <jfpx/sphere_collider.hpp>

#include <vector>

int contacts_in_double();
int contacts_in_double() {
  static_assert(sizeof(jfpx::Real) == sizeof(double));
  const std::vector<jfpx::SphereInstance> spheres = {{{0, 0, 0}, 1}, {{1, 0, 0}, 1}};
  return static_cast<int>(jfpx::make_sphere_collider()->find_contacts(spheres).size());
}
