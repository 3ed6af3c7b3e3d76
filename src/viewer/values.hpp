/// Numbers about bodies: for colouring, and for picking with the mouse.
#pragma once

#include "src/viewer/stage.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace view {

/// A value in [0, 1] for each body, scaled to the largest of the moment where there is no natural
/// scale; empty for Colouring::bodies and islands.
std::vector<Real> colour_values(const Scene& scene, const Moment& moment, Colouring colouring);

/// Where a ray enters a shape, as a distance along its unit direction; kMaxReal if it misses or
/// the shape lies behind.
Real ray_distance(const Sphere& sphere, const BodyState& state, const Vec3& from,
                  const Vec3& direction);
Real ray_distance(const Box& box, const BodyState& state, const Vec3& from, const Vec3& direction);
Real ray_distance(const HalfSpace& plane, const BodyState& state, const Vec3& from,
                  const Vec3& direction);
Real ray_distance(const Plane& plane, const BodyState& state, const Vec3& from,
                  const Vec3& direction);
Real ray_distance(const Compound& compound, const BodyState& state, const Vec3& from,
                  const Vec3& direction);

/// Radius of a ball around the body's position that holds the shape [m]; 0 for planes.
Real size_of(const Shape& shape);
/// Where a part of an compound is.
BodyState placed(const CompoundPart& part, const BodyState& body);
/// True for shapes without end.
bool is_endless(const Shape& shape);

}  // namespace view
}  // namespace JFPX_ABI
}  // namespace jfpx
