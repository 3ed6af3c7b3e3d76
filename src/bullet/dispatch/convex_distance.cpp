/// Selects the detector for the cores of two shapes.
#include "src/bullet/dispatch/convex_distance.hpp"

#include "src/bullet/dispatch/visit_core.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {
namespace {

/// Whether Bullet has a distance function of its own for both shapes.
bool are_round(int a, int b) {
  const auto is_round = [](int type) {
    return type == SPHERE_SHAPE_PROXYTYPE || type == CAPSULE_SHAPE_PROXYTYPE;
  };
  return is_round(a) && is_round(b);
}

}  // namespace

DetectorResult find_closest_points(const ConvexPairInput& input, DetectorContact* contact) {
  // Not on the stack, which may be small.
  static thread_local HullPoints room_a, room_b;
  const btConvexShape &shape_a = input.shape_a, &shape_b = input.shape_b;
  if (are_round(shape_a.getShapeType(), shape_b.getShapeType())) return DetectorResult::unknown;
  // Relative to the midpoint of the two bodies, for better precision.
  const btVector3 offset = (input.pose_a.getOrigin() + input.pose_b.getOrigin()) * btScalar(0.5);
  btTransform a = input.pose_a, b = input.pose_b;
  a.getOrigin() -= offset;
  b.getOrigin() -= offset;
  DetectorInput detector{.margin_a = shape_a.getMargin(),
                         .margin_b = shape_b.getMargin(),
                         .maximum_distance_squared = 0,
                         .offset = offset};
  const btScalar reach = detector.margin_a + detector.margin_b + input.threshold;
  detector.maximum_distance_squared = reach * reach;
  DetectorResult result = DetectorResult::unknown;
  visit_core(shape_a, a, &room_a, [&](const auto& core_a) {
    visit_core(shape_b, b, &room_b, [&](const auto& core_b) {
      result = find_closest_points(core_a, core_b, detector, contact);
    });
  });
  return result;
}

}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
