/// Full of what our own sources may not do: it compiles as its owner wants it.
#include <jfpx/sphere_collider.hpp>

int main(int argc, char**) {
  int unused;
  const float narrowed = 1e10;
  const unsigned char small = argc;
  return jfpx::make_sphere_collider()->find_contacts({}).size() + small - argc + (narrowed < 0);
}
