/// Closest points of a sphere and a box in either order.
#include "src/bullet/dispatch/sphere_box.hpp"

#include "src/bullet/dispatch/cores.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {

SphereBoxResult find_closest_points(const SphereBoxInput& input, SphereBoxContact* contact) {
  // Relative to the midpoint of the two bodies, for better precision.
  const btVector3 offset = (input.pose_a.getOrigin() + input.pose_b.getOrigin()) * btScalar(0.5);
  btTransform a = input.pose_a, b = input.pose_b;
  a.getOrigin() -= offset;
  b.getOrigin() -= offset;
  const DetectorInput detector{.margin_a = input.margin_a,
                               .margin_b = input.margin_b,
                               .maximum_distance_squared = input.maximum_distance_squared,
                               .offset = offset};
  if (input.sphere_first) {
    return find_closest_points(CenterCore(a), BoxCore(b, input.core), detector, contact);
  }
  return find_closest_points(BoxCore(a, input.core), CenterCore(b), detector, contact);
}

}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
