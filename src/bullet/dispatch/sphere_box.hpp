/// Closest points of a sphere and a box, equal to those of btGjkPairDetector.
#pragma once

#include <jfpx/config.hpp>

#include "src/bullet/dispatch/core_distance.hpp"

#include <LinearMath/btTransform.h>

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {

/// Input of the detector: two convex shapes, one a sphere and the other a box.
struct SphereBoxInput {
  btTransform pose_a, pose_b;
  btScalar margin_a, margin_b;  ///< the margin of a sphere is its radius
  btVector3 core;               ///< half extents of the box, margin excluded
  bool sphere_first;
  btScalar maximum_distance_squared;
};

using SphereBoxContact = DetectorContact;
using SphereBoxResult = DetectorResult;

/// The closest points of the two shapes.
SphereBoxResult find_closest_points(const SphereBoxInput& input, SphereBoxContact* contact);

}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
