/// Extents of shapes, and intersections of rays with them.
#include "src/viewer/shapes.hpp"

#include <algorithm>

namespace jfpx {
inline namespace JFPX_ABI {
namespace view {
namespace {

Real size_of(const Sphere& sphere) { return sphere.radius; }
Real size_of(const Box& box) { return length(box.half_extents); }
Real size_of(const HalfSpace&) { return 0; }
Real size_of(const Plane&) { return 0; }
Real size_of(const Compound& compound) {
  Real size = 0;
  for (const CompoundPart& part : compound.parts) {
    const Real own = std::visit([](const auto& s) { return size_of(s); }, part.shape);
    size = std::max(size, length(part.position) + own);
  }
  return size;
}

Real ray_distance(const Sphere& sphere, const BodyState& state, const Vec3& from,
                  const Vec3& direction) {
  const Vec3 to_centre = state.position - from;
  const Real along = dot(to_centre, direction);
  const Real miss = length_squared(to_centre - direction * along);
  const Real rest = sphere.radius * sphere.radius - miss;
  if (along <= 0 || rest < 0) return kMaxReal;
  return along - square_root(rest);
}

Real ray_distance(const Box& box, const BodyState& state, const Vec3& from, const Vec3& direction) {
  const Transform pose = make_transform(state.orientation, state.position);
  const Vec3 p = inverse_transform_point(pose, from);
  const Vec3 d = inverse_transform_direction(pose, direction);
  Real enter = 0, leave = kMaxReal;
  for (int i = 0; i < 3; ++i) {
    const Real h = box.half_extents[i];
    if (absolute(d[i]) < kEpsilon) {
      if (absolute(p[i]) > h) return kMaxReal;
      continue;
    }
    const Real first = (-h - p[i]) / d[i], second = (h - p[i]) / d[i];
    enter = std::max(enter, std::min(first, second));
    leave = std::min(leave, std::max(first, second));
  }
  return enter <= leave ? enter : kMaxReal;
}

Real ray_distance(const HalfSpace&, const BodyState&, const Vec3&, const Vec3&) { return kMaxReal; }
Real ray_distance(const Plane&, const BodyState&, const Vec3&, const Vec3&) { return kMaxReal; }

Real ray_distance(const Compound& compound, const BodyState& state, const Vec3& from,
                  const Vec3& direction) {
  Real nearest = kMaxReal;
  for (const CompoundPart& part : compound.parts) {
    const BodyState place = placed(part, state);
    const auto distance = [&](const auto& s) { return ray_distance(s, place, from, direction); };
    nearest = std::min(nearest, std::visit(distance, part.shape));
  }
  return nearest;
}

}  // namespace

Real ray_distance(const Shape& shape, const BodyState& state, const Vec3& from,
                  const Vec3& direction) {
  return std::visit([&](const auto& s) { return ray_distance(s, state, from, direction); }, shape);
}

Real size_of(const Shape& shape) {
  return std::visit([](const auto& s) { return size_of(s); }, shape);
}

BodyState placed(const CompoundPart& part, const BodyState& body) {
  return {to_world_point(body, part.position), body.orientation * part.orientation, {}, {}};
}

bool is_endless(const Shape& shape) {
  return std::holds_alternative<HalfSpace>(shape) || std::holds_alternative<Plane>(shape);
}

}  // namespace view
}  // namespace JFPX_ABI
}  // namespace jfpx
