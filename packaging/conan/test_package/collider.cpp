/// Finds the contact of two touching spheres.
#include <jfpx/sphere_collider.hpp>

#include <cstdio>
#include <vector>

int main() {
  const std::vector<jfpx::SphereInstance> spheres = {{{0, 0, 0}, 1}, {{1.5, 0, 0}, 1}};
  const auto collider = jfpx::make_sphere_collider();
  const auto contacts = collider->find_contacts(spheres);
  std::printf("%d contact of %d-byte reals\n", static_cast<int>(contacts.size()),
              static_cast<int>(sizeof(jfpx::Real)));
  return contacts.size() == 1 ? 0 : 1;
}
