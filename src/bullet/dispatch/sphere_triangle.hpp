/// Contact of a sphere and a triangle, equal to that of Bullet's SphereTriangleDetector.
#pragma once

#include <jfpx/config.hpp>

#include <LinearMath/btVector3.h>

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {

/// A sphere in the space of the triangles.
struct SphereTriangleInput {
  btVector3 center;
  btScalar radius;
  btScalar threshold;  ///< distance of the surfaces below which a contact exists
};

struct SphereTriangleContact {
  btVector3 normal_on_triangle;
  btVector3 point_on_triangle;
  btScalar distance;
};

/// Reproduces SphereTriangleDetector::collide of Bullet 3.24, operation by operation.
/// @return false if there is no contact
bool find_contact(const SphereTriangleInput& sphere, const btVector3* vertices,
                  SphereTriangleContact* contact);

}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
