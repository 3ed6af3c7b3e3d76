/// Numbers about bodies: for colouring, and for picking with the mouse.
#include "src/viewer/values.hpp"

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

}  // namespace

std::vector<Real> colour_values(const Scene& scene, const Moment& moment, Colouring colouring) {
  if (colouring == Colouring::bodies || colouring == Colouring::islands) return {};
  std::vector<Real> values(scene.bodies.size());
  if (colouring == Colouring::speed) {
    for (std::size_t i = 0; i < values.size(); ++i) values[i] = length(moment.states[i].velocity);
  }
  if (colouring == Colouring::sleep) {
    for (std::size_t i = 0; i < values.size(); ++i) values[i] = moment.awake[i];
    return values;
  }
  for (const Contact& contact : moment.contacts) {
    for (const std::uint32_t body : {contact.a, contact.b}) {
      Real& value = values[body];
      if (colouring == Colouring::penetration) value = std::max(value, -contact.distance);
      if (colouring == Colouring::contacts) value += 1;
    }
  }
  Real largest = 0;
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (scene.bodies[i].mass > 0) largest = std::max(largest, values[i]);
  }
  if (largest > 0) {
    for (Real& value : values) value /= largest;
  }
  return values;
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

// Planes are never picked: they do not move.
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
