/// Closest points of a sphere and a box, equal to those of btGjkPairDetector.
#pragma once

#include <jfpx/config.hpp>

#include <LinearMath/btTransform.h>

#include <cstdint>

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

struct SphereBoxContact {
  btVector3 normal_on_b;
  btVector3 point_on_b;
  btScalar distance;
};

enum class SphereBoxResult : std::uint8_t {
  apart,
  contact,
  unknown,  ///< deep or degenerate: Bullet continues with its penetration depth solver
};

/// Reproduces btGjkPairDetector::getClosestPointsNonVirtual of Bullet 3.24, operation by operation,
/// up to the call of the penetration depth solver.
SphereBoxResult find_closest_points(const SphereBoxInput& input, SphereBoxContact* contact);

}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
