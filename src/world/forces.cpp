/// Validation and application of the forces of force.hpp.
#include <jfpx/error.hpp>
#include <jfpx/force.hpp>

#include "src/scene/scene_validate.hpp"
#include "src/world/force_laws.hpp"
#include "src/world/integrate.hpp"
#include "src/world/submerged.hpp"

#include <algorithm>

namespace jfpx {
inline namespace JFPX_ABI {
namespace {

/// Checks the fields of one force, with error messages in the common form.
class Check {
 public:
  Check(const char* force, const ForceContext& context) : force_(force), context_(context) {}

  template <class Value>
  void require(bool good, const char* field, const Value& value, const char* range) const {
    if (good) return;
    throw InvalidArgument(std::string(force_) + ": " + field + " is " + to_text(value) +
                          "; it must be " + range);
  }
  void finite(const char* field, const Vec3& value) const {
    require(is_finite(value), field, value, "finite");
  }
  void finite(const char* field, const Mat3& value) const {
    for (const Vec3& row : value.row) finite(field, row);
  }
  void not_negative(const char* field, Real value) const {
    require(value >= 0 && is_finite(value), field, value, "finite and >= 0");
  }
  void positive(const char* field, Real value) const {
    require(value > 0 && is_finite(value), field, value, "finite and > 0");
  }
  void alive(const char* field, const std::optional<BodyId>& body) const {
    if (!body || context_.contains(*body)) return;
    throw InvalidArgument(std::string(force_) + ": " + field + " (index " +
                          std::to_string(body->index) + ", generation " +
                          std::to_string(body->generation) +
                          ") is unknown; it must be of a living body of this world");
  }
  void spring(const Attachment& a, const Attachment& b, Real stiffness, Real damping,
              Real rest_length) const {
    alive("a.body", a.body);
    alive("b.body", b.body);
    if (a.body == b.body) {
      throw InvalidArgument(std::string(force_) +
                            (a.body ? ": both ends are fixed to one body" : ": no end has a body") +
                            "; it must join two bodies, or a body and the world");
    }
    finite("a.point", a.point);
    finite("b.point", b.point);
    not_negative("stiffness", stiffness);
    not_negative("damping", damping);
    not_negative("rest_length", rest_length);
  }

 private:
  const char* force_;
  const ForceContext& context_;
};

/// Calls act(id) for the given body if it lives and is awake, or for all awake bodies.
template <class Act>
void for_awake(const ForceContext& context, const std::optional<BodyId>& body, Act act) {
  if (body) {
    if (context.contains(*body) && context.awake(*body)) act(*body);
    return;
  }
  for (const BodyId id : context.bodies()) {
    if (context.awake(id)) act(id);
  }
}

/// Position and velocity of a point of a body or of the world.
struct MovingPoint {
  Vec3 position, velocity;
};
MovingPoint moving_point(const BodyState& body, const Vec3& point) {
  const Vec3 arm = rotate(body.orientation, point);
  return {body.position + arm, body.velocity + cross(body.angular_velocity, arm)};
}
MovingPoint moving_point(const ForceContext& context, const Attachment& end) {
  return end.body ? moving_point(context.state(*end.body), end.point) : MovingPoint{end.point, {}};
}

/// Applies the force of a Spring or a Bungee.
template <class S>
void apply_spring(ForceContext& context, const S& spring, bool slack) {
  for (const Attachment& end : {spring.a, spring.b}) {
    if (end.body && !context.contains(*end.body)) return;
  }
  if (spring.a.body && spring.b.body) context.link(*spring.a.body, *spring.b.body);
  const MovingPoint a = moving_point(context, spring.a), b = moving_point(context, spring.b);
  const Vec3 force =
      detail::spring_force(a.position - b.position, a.velocity - b.velocity, spring.stiffness,
                           spring.damping, spring.rest_length, slack);
  if (spring.a.body) context.apply_force_at_point(*spring.a.body, force, a.position);
  if (spring.b.body) context.apply_force_at_point(*spring.b.body, -force, b.position);
}

/// Applies the force of an Aero or an AeroControl.
void apply_aero(ForceContext& context, BodyId body, const Mat3& tensor, const Vec3& point,
                const Vec3& wind) {
  if (!context.contains(body) || !context.awake(body)) return;
  const BodyState state = context.state(body);
  const Mat3 axes = to_matrix(state.orientation);
  const MovingPoint surface = moving_point(state, point);
  const Vec3 airspeed = transform_transpose(axes, surface.velocity - wind);
  context.apply_force_at_point(body, axes * (tensor * airspeed), surface.position);
}

Real submerged_volume(const Sphere& sphere, const Vec3& centre, const HalfSpace& liquid) {
  return detail::submerged_volume(sphere.radius, liquid.offset - dot(liquid.normal, centre));
}

/// Applies the buoyancy of a box at the centroid of the displaced volume.
void apply_box_buoyancy(ForceContext& context, BodyId body, const Box& box, const Transform& pose,
                        const HalfSpace& liquid, const Vec3& weight) {
  // Computed relative to the centre of the box, so that the centroid keeps its precision far from
  // the origin.
  const HalfSpace below{liquid.normal, liquid.offset - dot(liquid.normal, pose.origin)};
  detail::Submerged part;
  detail::add_submerged(box, {pose.basis, {}}, below, &part);
  if (!(part.volume > 0)) return;
  context.apply_force_at_point(body, weight * part.volume,
                               pose.origin + part.moment * (1 / part.volume));
}

}  // namespace

void Gravity::validate(const ForceContext& context) const {
  const Check check("gravity", context);
  check.finite("acceleration", acceleration);
  check.alive("body", body);
}
void Gravity::operator()(ForceContext& context) const {
  for_awake(context, body,
            [&](BodyId id) { context.apply_force(id, acceleration * context.mass(id)); });
}

void Drag::validate(const ForceContext& context) const {
  const Check check("drag", context);
  check.not_negative("linear", linear);
  check.not_negative("quadratic", quadratic);
  check.finite("wind", wind);
  check.alive("body", body);
}
void Drag::operator()(ForceContext& context) const {
  for_awake(context, body, [&](BodyId id) {
    const Vec3 velocity = context.state(id).velocity - wind;
    context.apply_force(id, detail::drag_force(velocity, linear, quadratic));
  });
}

void Spring::validate(const ForceContext& context) const {
  Check("spring", context).spring(a, b, stiffness, damping, rest_length);
}
void Spring::operator()(ForceContext& context) const { apply_spring(context, *this, false); }

void Bungee::validate(const ForceContext& context) const {
  Check("bungee", context).spring(a, b, stiffness, damping, rest_length);
}
void Bungee::operator()(ForceContext& context) const { apply_spring(context, *this, true); }

void Aero::validate(const ForceContext& context) const {
  const Check check("aero", context);
  check.alive("body", body);
  check.finite("tensor", tensor);
  check.finite("point", point);
  check.finite("wind", wind);
}
void Aero::operator()(ForceContext& context) const {
  apply_aero(context, body, tensor, point, wind);
}

void AeroControl::validate(const ForceContext& context) const {
  const Check check("aero control", context);
  check.alive("body", body);
  check.finite("lowest", lowest);
  check.finite("base", base);
  check.finite("highest", highest);
  check.finite("point", point);
  check.finite("wind", wind);
  check.require(is_finite(control), "control", control, "finite");
}
void AeroControl::operator()(ForceContext& context) const {
  apply_aero(context, body, tensor(), point, wind);
}
Mat3 AeroControl::tensor() const {
  const Real share = std::min(absolute(control), Real(1));
  return interpolate(base, control < 0 ? lowest : highest, share);
}

void Buoyancy::validate(const ForceContext& context) const {
  const Check check("buoyancy", context);
  check.require(absolute(length_squared(liquid.normal) - 1) <= kUnitTolerance, "liquid.normal",
                liquid.normal, "a unit vector, to a thousandth");
  check.require(is_finite(liquid.offset), "liquid.offset", liquid.offset, "finite");
  check.not_negative("density", density);
  check.not_negative("gravity", gravity);
  check.alive("body", body);
}
void Buoyancy::operator()(ForceContext& context) const {
  const Vec3 weight = normalized(liquid.normal) * (density * gravity);  // [N/m^3]
  for_awake(context, body, [&](BodyId id) {
    const BodyState state = context.state(id);
    const Transform pose = make_transform(state.orientation, state.position);
    if (const auto* sphere = std::get_if<Sphere>(&context.shape(id))) {
      context.apply_force(id, weight * submerged_volume(*sphere, state.position, liquid));
    } else if (const auto* box = std::get_if<Box>(&context.shape(id))) {
      apply_box_buoyancy(context, id, *box, pose, liquid, weight);
    } else if (const auto* compound = std::get_if<Compound>(&context.shape(id))) {
      for (const CompoundPart& part : compound->parts) {
        const Transform part_pose = pose * make_transform(part.orientation, part.position);
        if (const auto* ball = std::get_if<Sphere>(&part.shape)) {
          const Vec3 force = weight * submerged_volume(*ball, part_pose.origin, liquid);
          context.apply_force_at_point(id, force, part_pose.origin);
        } else {
          apply_box_buoyancy(context, id, std::get<Box>(part.shape), part_pose, liquid, weight);
        }
      }
    }
  });
}

void Explosion::validate(const ForceContext& context) const {
  const Check check("explosion", context);
  check.finite("centre", centre);
  check.require(is_finite(start), "start", start, "finite");
  check.not_negative("peak_force", peak_force);
  check.positive("speed", speed);
  check.positive("thickness", thickness);
  check.positive("duration", duration);
}
void Explosion::operator()(ForceContext& context) const {
  const auto age = static_cast<Real>(context.time() - static_cast<double>(start));
  for (const BodyId id : context.bodies()) {
    const Vec3 away = context.state(id).position - centre;
    const Real distance = length(away);
    const Real share = detail::blast(distance, age, speed, thickness, duration);
    if (!(share > 0 && distance > kEpsilon)) continue;
    context.wake(id);
    context.apply_force(id, away * (peak_force * share / distance));
  }
}

}  // namespace JFPX_ABI
}  // namespace jfpx
