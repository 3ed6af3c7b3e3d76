/// The closest points of a sphere and a box, as btGjkPairDetector finds them.
#pragma once

#include <jfpx/config.hpp>

#include <LinearMath/btTransform.h>

#include <cstdint>

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {

/// What the detector needs to know of two convex shapes, one of them a sphere and the other a box.
struct SphereBoxInput {
  btTransform pose_a, pose_b;
  btScalar margin_a, margin_b;  ///< a sphere's is its radius
  btVector3 core;               ///< half extents of the box, margin excluded
  bool sphere_first;
  btScalar maximum_distance_squared;
};

struct SphereBoxContact {
  btVector3 normal_on_b;
  btVector3 point_on_b;
  btScalar distance;
};

enum class SphereBoxAnswer : std::uint8_t {
  apart,
  contact,
  unknown,  ///< deep or degenerate: Bullet goes on with its penetration depth solver
};

/// Does what btGjkPairDetector::getClosestPointsNonVirtual of Bullet 3.24 does, operation by
/// operation, up to where the penetration depth solver would be asked.
SphereBoxAnswer find_closest_points(const SphereBoxInput& input, SphereBoxContact* contact);

}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
