/// Closest points of two convex shapes, equal to those of btGjkPairDetector.
#pragma once

#include <jfpx/config.hpp>

#include "src/bullet/dispatch/core_distance.hpp"

#include <LinearMath/btTransform.h>

class btConvexShape;

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {

/// Input of the detector. The shapes must be exactly classes of Bullet.
struct ConvexPairInput {
  const btConvexShape &shape_a, &shape_b;
  const btTransform &pose_a, &pose_b;
  btScalar threshold;  ///< distance beyond the margins at which the shapes are apart
};

/// The closest points of spheres, boxes, capsules, cylinders and hulls.
/// @return `unknown` also for other shapes, and for pairs that btConvexConvexAlgorithm does not
///   pass to the detector
DetectorResult find_closest_points(const ConvexPairInput& input, DetectorContact* contact);

}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
