/// Validation of scenes and bodies.
#include "src/scene/scene_validate.hpp"

#include <jfpx/error.hpp>

#include "src/collide/shapes.hpp"
#include "src/scene/compound.hpp"
#include "src/scene/inertia.hpp"
#include "src/scene/inertia_tensor.hpp"
#include "src/scene/principal_inertia.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <initializer_list>
#include <limits>
#include <span>
#include <utility>

namespace jfpx {
inline namespace JFPX_ABI {
namespace {

std::string list_text(std::initializer_list<Real> values) {
  std::string text = "(";
  for (const Real value : values) {
    if (text.size() > 1) text += ", ";
    text += to_text(value);
  }
  return text += ")";
}

template <class Value>
std::string fault(std::string_view field, const Value& value, std::string_view range) {
  return std::string(field) + " is " + to_text(value) + "; it must be " + std::string(range);
}

bool in_world(Real x) { return absolute(x) <= kMaxCoordinate; }
bool in_world(const Vec3& v) { return in_world(v.x) && in_world(v.y) && in_world(v.z); }
bool is_size(Real x) { return x > 0 && in_world(x); }
bool is_unit(Real length_squared) { return absolute(length_squared - 1) <= kUnitTolerance; }

bool has_inverse(Real moment) {
  return moment > 0 && is_finite(moment) && is_finite(Real(1) / moment);
}

std::string find_fault(const Sphere& sphere) {
  if (is_size(sphere.radius)) return {};
  return fault("radius", sphere.radius, "> 0 and at most 1e9");
}

std::string find_fault(const Box& box) {
  const Vec3& h = box.half_extents;
  if (is_size(h.x) && is_size(h.y) && is_size(h.z)) return {};
  return fault("half_extents", h, "> 0 and at most 1e9 each");
}

std::string find_fault(const Vec3& normal, Real offset) {
  if (!is_unit(length_squared(normal))) {
    return fault("normal", normal, "a unit vector, to a thousandth");
  }
  return in_world(offset) ? std::string() : fault("offset", offset, "between -1e9 and 1e9");
}

std::string find_fault(const CompoundPart& part) {
  std::string found = std::visit([](const auto& shape) { return find_fault(shape); }, part.shape);
  if (!found.empty()) return found;
  if (!in_world(part.position)) return fault("position", part.position, "between -1e9 and 1e9");
  if (!is_unit(length_squared(part.orientation))) {
    return fault("orientation", part.orientation, "a unit quaternion, to a thousandth");
  }
  if (part.density > 0 && part.density <= Real(1e9)) return {};
  return fault("density", part.density, "> 0 and at most 1e9");
}

std::string find_moments_fault(const Vec3& moments) {
  if (has_inverse(moments.x) && has_inverse(moments.y) && has_inverse(moments.z)) return {};
  return fault("moments of inertia", moments, "such that they and their inverses are finite");
}

std::string find_solid_fault(const Sphere& sphere, Real mass) {
  const Real inertia = detail::moments_of_inertia(sphere, mass).x;
  if (has_inverse(inertia)) return {};
  return fault("moment of inertia", inertia, "such that it and its inverse are finite");
}
std::string find_solid_fault(const Box& box, Real mass) {
  return find_moments_fault(detail::moments_of_inertia(box, mass));
}
std::string find_solid_fault(const Compound& compound, Real mass) {
  return find_moments_fault(principal_inertia(mass_properties(compound, mass).inertia).moments);
}
std::string find_solid_fault(const HalfSpace&, Real) { return {}; }
std::string find_solid_fault(const Plane&, Real) { return {}; }

std::string find_fault(const Sphere& sphere, Real mass) {
  std::string found = find_fault(sphere);
  if (!found.empty() || mass == 0) return found;
  return find_solid_fault(sphere, mass);
}

std::string find_fault(const Box& box, Real mass) {
  std::string found = find_fault(box);
  if (!found.empty() || mass == 0) return found;
  return find_solid_fault(box, mass);
}

std::string find_fault(const HalfSpace& half_space, Real) {
  return find_fault(half_space.normal, half_space.offset);
}

std::string find_fault(const Plane& plane, Real) { return find_fault(plane.normal, plane.offset); }

std::string find_fault(const Compound& compound, Real mass) {
  if (compound.parts.empty()) return "parts is empty; it must have at least one sphere or box";
  Real radius = 0;
  for (std::size_t i = 0; i < compound.parts.size(); ++i) {
    const CompoundPart& part = compound.parts[i];
    const std::string found = find_fault(part);
    if (!found.empty()) return "parts[" + std::to_string(i) + "]." + found;
    radius = std::max(radius, outer_radius(part));
  }
  if (mass == 0) return {};
  std::string found = find_solid_fault(compound, mass);
  const Vec3 centre = mass_properties(compound, mass).centre;
  if (!found.empty() || length(centre) <= radius * kUnitTolerance) return found;
  return fault("centre of mass of parts", centre,
               "the origin, to a thousandth of the body's radius; centred() moves it there");
}

std::string find_fault(const BodyDef& def) {
  std::string found = find_mass_fault(def.mass);
  if (!found.empty()) return found;
  if (def.kinematic && def.mass > 0) {
    return fault("mass", def.mass, "0 for a kinematic body");
  }
  if (def.kinematic && std::holds_alternative<HalfSpace>(def.shape)) {
    return "kinematic is true; it must be false for a half-space, which follows no pose";
  }
  if (def.kinematic && std::holds_alternative<Plane>(def.shape)) {
    return "kinematic is true; it must be false for a plane, which follows no pose";
  }
  if (def.mass > 0 && std::holds_alternative<HalfSpace>(def.shape)) {
    return fault("mass", def.mass, "0 for a half-space, which fills half of the world");
  }
  if (def.mass > 0 && std::holds_alternative<Plane>(def.shape)) {
    return fault("mass", def.mass, "0 for a plane, which divides the whole world");
  }
  if (def.inertia) found = find_inertia_fault(*def.inertia);
  if (!found.empty()) return found;
  const Real solid_mass = def.inertia ? 0 : def.mass;  // 0: the inertia of the shape is not used
  found = std::visit([solid_mass](const auto& shape) { return find_fault(shape, solid_mass); },
                     def.shape);
  if (!found.empty()) return found;
  found = find_fault(BodyState{def.position, def.orientation, def.velocity, def.angular_velocity});
  if (!found.empty()) return found;
  found = find_acceleration_fault(def.acceleration);
  if (!found.empty()) return found;
  found = find_damping_fault(def.linear_damping, def.angular_damping);
  if (!found.empty()) return found;
  found = find_friction_fault(def.friction);
  if (found.empty()) found = find_restitution_fault(def.restitution);
  if (!found.empty()) return found;
  if (!(def.rolling_friction >= 0 && is_finite(def.rolling_friction))) {
    return fault("rolling_friction", def.rolling_friction, "finite and >= 0");
  }
  if (!(def.spinning_friction >= 0 && is_finite(def.spinning_friction))) {
    return fault("spinning_friction", def.spinning_friction, "finite and >= 0");
  }
  return {};
}

std::string find_fault(const SoftStepSettings& soft_step) {
  if (!(soft_step.substeps >= 1 && soft_step.substeps <= kMaxSubsteps)) {
    return fault("soft_step.substeps", static_cast<Real>(soft_step.substeps), "from 1 to 64");
  }
  if (!(soft_step.contact_hertz >= 0 && is_finite(soft_step.contact_hertz))) {
    return fault("soft_step.contact_hertz", soft_step.contact_hertz, "finite and >= 0");
  }
  if (!(soft_step.damping_ratio >= Real(0.01) && soft_step.damping_ratio <= 1000)) {
    return fault("soft_step.damping_ratio", soft_step.damping_ratio, "in [0.01, 1000]");
  }
  if (!(soft_step.push_out_speed > 0 && is_finite(soft_step.push_out_speed))) {
    return fault("soft_step.push_out_speed", soft_step.push_out_speed, "finite and > 0");
  }
  if (!(soft_step.restitution_threshold >= 0 && is_finite(soft_step.restitution_threshold))) {
    return fault("soft_step.restitution_threshold", soft_step.restitution_threshold,
                 "finite and >= 0");
  }
  if (!(soft_step.speculative_margin >= 0 && soft_step.speculative_margin <= kMaxCoordinate)) {
    return fault("soft_step.speculative_margin", soft_step.speculative_margin, "in [0, 1e9]");
  }
  return {};
}

std::string find_fault(const ResolverSettings& resolver) {
  if (!(resolver.velocity_epsilon > 0 && is_finite(resolver.velocity_epsilon))) {
    return fault("resolver.velocity_epsilon", resolver.velocity_epsilon, "finite and > 0");
  }
  if (!(resolver.position_epsilon > 0 && is_finite(resolver.position_epsilon))) {
    return fault("resolver.position_epsilon", resolver.position_epsilon, "finite and > 0");
  }
  if (!(resolver.restitution_velocity >= 0 && is_finite(resolver.restitution_velocity))) {
    return fault("resolver.restitution_velocity", resolver.restitution_velocity, "finite and >= 0");
  }
  if (!(resolver.angular_limit > 0 && resolver.angular_limit <= 1)) {
    return fault("resolver.angular_limit", resolver.angular_limit, "in (0, 1]");
  }
  return {};
}

std::string find_fault(const MaterialSettings& materials) {
  for (const auto& [field, rule] : {std::pair("materials.friction", materials.friction),
                                    std::pair("materials.restitution", materials.restitution)}) {
    if (to_string(rule) == nullptr) {
      return fault(field, static_cast<Real>(rule), "one of the rules of CombineRule");
    }
  }
  return {};
}

std::string find_fault(std::span<const BodyPair> ignored_pairs, std::uint64_t bodies) {
  for (std::size_t i = 0; i < ignored_pairs.size(); ++i) {
    const auto [a, b] = ignored_pairs[i];
    if (a != b && a < bodies && b < bodies) continue;
    return "ignored_pairs[" + std::to_string(i) + "] is (" + std::to_string(a) + ", " +
           std::to_string(b) + "); it must be two different indices of the scene's " +
           std::to_string(bodies) + " bodies";
  }
  return {};
}

std::string find_fault(const SleepSettings& sleep) {
  if (!(sleep.epsilon > 0 && is_finite(sleep.epsilon))) {
    return fault("sleep.epsilon", sleep.epsilon, "finite and > 0");
  }
  if (!(sleep.speed >= 0 && is_finite(sleep.speed))) {
    return fault("sleep.speed", sleep.speed, "finite and >= 0");
  }
  if (!(sleep.time >= 0 && is_finite(sleep.time))) {
    return fault("sleep.time", sleep.time, "finite and >= 0");
  }
  if (!(sleep.bias > 0 && sleep.bias <= 1)) return fault("sleep.bias", sleep.bias, "in (0, 1]");
  return {};
}

}  // namespace

std::string to_text(Real value) {
  std::array<char, 32> text;
  const auto [end, error] = std::to_chars(text.data(), text.data() + text.size(), value);
  return {text.data(), end};
}

std::string to_text(const Vec3& v) { return list_text({v.x, v.y, v.z}); }
std::string to_text(const Mat3& m) {
  std::string text;
  for (const Vec3& row : m.row) text += (text.empty() ? "(" : ", ") + to_text(row);
  return text += ")";
}
std::string to_text(const Quat& q) { return list_text({q.w, q.x, q.y, q.z}); }

std::string find_fault(const BodyState& state) {
  if (!in_world(state.position)) return fault("position", state.position, "between -1e9 and 1e9");
  if (!is_unit(length_squared(state.orientation))) {
    return fault("orientation", state.orientation, "a unit quaternion, to a thousandth");
  }
  if (!is_finite(state.velocity)) return fault("velocity", state.velocity, "finite");
  if (!is_finite(state.angular_velocity)) {
    return fault("angular_velocity", state.angular_velocity, "finite");
  }
  return {};
}

std::string find_mass_fault(Real mass) {
  if (!(mass >= 0 && is_finite(mass))) return fault("mass", mass, "finite and >= 0");
  if (mass == 0 || is_finite(Real(1) / mass)) return {};
  return fault("mass", mass, "0 or such that its inverse is finite");
}

std::string find_inertia_fault(const Mat3& inertia) {
  const char* range = inertia_must_be(inertia);
  return range != nullptr ? fault("inertia", inertia, range) : std::string();
}

std::string find_inertia_fault(const Shape& shape, Real mass) {
  return std::visit([mass](const auto& s) { return find_solid_fault(s, mass); }, shape);
}

std::string find_acceleration_fault(const Vec3& acceleration) {
  if (is_finite(acceleration)) return {};
  return fault("acceleration", acceleration, "finite");
}

std::string find_damping_fault(Real linear, Real angular) {
  if (!(linear > 0 && linear <= 1)) return fault("linear_damping", linear, "in (0, 1]");
  if (!(angular > 0 && angular <= 1)) return fault("angular_damping", angular, "in (0, 1]");
  return {};
}

std::string find_friction_fault(Real friction) {
  if (friction >= 0 && is_finite(friction)) return {};
  return fault("friction", friction, "finite and >= 0");
}

std::string find_restitution_fault(Real restitution) {
  if (restitution >= 0 && restitution <= 1) return {};
  return fault("restitution", restitution, "in [0, 1]");
}

void validate_body(const BodyDef& def, std::uint64_t body) {
  const std::string found = find_fault(def);
  if (!found.empty()) throw InvalidScene("body " + std::to_string(body) + ": " + found);
}

void validate_body_count(std::uint64_t bodies) {
  constexpr std::uint64_t kMax = std::numeric_limits<std::uint32_t>::max();
  if (bodies <= kMax) return;
  throw InvalidScene("the scene has " + std::to_string(bodies) + " bodies; it must have at most " +
                     std::to_string(kMax));
}

void validate(const Scene& scene) {
  // The smallest normal number: a denormal dt, and all values computed from it, lose digits.
  if (!(scene.dt >= std::numeric_limits<Real>::min() && is_finite(scene.dt))) {
    throw InvalidScene("scene: " + fault("dt", scene.dt, "finite, > 0 and not denormal"));
  }
  if (to_string(scene.solver) == nullptr) {
    throw InvalidScene("scene: " + fault("solver", static_cast<Real>(scene.solver),
                                         "one of the values of Solver"));
  }
  for (const std::string& found : {find_fault(scene.soft_step), find_fault(scene.resolver),
                                   find_fault(scene.sleep), find_fault(scene.materials)}) {
    if (!found.empty()) throw InvalidScene("scene: " + found);
  }
  validate_body_count(scene.bodies.size());
  for (std::size_t i = 0; i < scene.bodies.size(); ++i) validate_body(scene.bodies[i], i);
  const std::string found = find_fault(scene.ignored_pairs, scene.bodies.size());
  if (!found.empty()) throw InvalidScene("scene: " + found);
}

}  // namespace JFPX_ABI
}  // namespace jfpx
