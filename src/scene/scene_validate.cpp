/// Validation of scenes and bodies.
#include "src/scene/scene_validate.hpp"

#include <jfpx/error.hpp>

#include "src/scene/compound.hpp"
#include "src/scene/field_fault.hpp"
#include "src/scene/inertia.hpp"
#include "src/scene/inertia_tensor.hpp"
#include "src/scene/joint_fields.hpp"
#include "src/scene/principal_inertia.hpp"
#include "src/scene/scene_fields.hpp"

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

bool has_inverse(Real moment) {
  return moment > 0 && is_finite(moment) && is_finite(Real(1) / moment);
}

std::string find_moments_fault(const Vec3& moments) {
  if (has_inverse(moments.x) && has_inverse(moments.y) && has_inverse(moments.z)) return {};
  return fault("moments of inertia", moments, "such that they and their inverses are finite");
}

template <class S>
std::string find_solid_fault(const S& solid, Real mass) {
  if constexpr (std::is_same_v<S, Sphere>) {
    const Real inertia = detail::moments_of_inertia(solid, mass).x;
    if (has_inverse(inertia)) return {};
    return fault("moment of inertia", inertia, "such that it and its inverse are finite");
  } else if constexpr (std::is_same_v<S, Hull>) {
    return find_moments_fault(principal_inertia(solid.central_inertia(mass)).moments);
  } else if constexpr (std::is_same_v<S, Compound>) {
    return find_moments_fault(principal_inertia(mass_properties(solid, mass).inertia).moments);
  } else if constexpr (detail::kIsSolid<S>) {
    return find_moments_fault(detail::moments_of_inertia(solid, mass));
  } else {
    return {};
  }
}

std::string find_centre_fault(const Compound& compound, Real mass) {
  const Vec3 centre = mass_properties(compound, mass).centre;
  if (length(centre) <= outer_radius(compound) * kUnitTolerance) return {};
  return fault("centre of mass of parts", centre,
               "the origin, to a thousandth of the body's radius; centred() moves it there");
}

std::string find_centre_fault(const Hull& hull) {
  const Vec3 centre = hull.centre_of_mass();
  if (length(centre) <= detail::outer_radius(hull) * kUnitTolerance) return {};
  return fault("centre of mass of vertices", centre,
               "the origin, to a thousandth of the hull's radius; centred() moves it there");
}

/// Checks conditions between several fields, each of which must be in its range.
std::string find_coupled_fault(const BodyDef& def) {
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
  if (def.mass > 0 && std::holds_alternative<TriangleMesh>(def.shape)) {
    return fault("mass", def.mass, "0 for a triangle mesh, which has no volume");
  }
  if (def.mass > 0 && std::holds_alternative<Heightfield>(def.shape)) {
    return fault("mass", def.mass, "0 for a heightfield, which has no volume");
  }
  if (def.mass > 0 && std::holds_alternative<HalfSpace>(def.shape)) {
    return fault("mass", def.mass, "0 for a half-space, which fills half of the world");
  }
  if (def.mass > 0 && std::holds_alternative<Plane>(def.shape)) {
    return fault("mass", def.mass, "0 for a plane, which divides the whole world");
  }
  const auto* hull = std::get_if<Hull>(&def.shape);
  if (hull != nullptr && def.mass > 0) found = find_centre_fault(*hull);
  if (!found.empty()) return found;
  if (def.inertia) return find_inertia_fault(*def.inertia);
  if (def.mass > 0) found = find_inertia_fault(def.shape, def.mass);
  if (!found.empty() || def.mass == 0) return found;
  const auto* compound = std::get_if<Compound>(&def.shape);
  return compound == nullptr ? found : find_centre_fault(*compound, def.mass);
}

std::string find_pair_fault(std::span<const BodyPair> ignored_pairs, std::uint64_t bodies) {
  for (std::size_t i = 0; i < ignored_pairs.size(); ++i) {
    const auto [a, b] = ignored_pairs[i];
    if (a != b && a < bodies && b < bodies) continue;
    return "ignored_pairs[" + std::to_string(i) + "] is (" + std::to_string(a) + ", " +
           std::to_string(b) + "); it must be two different indices of the scene's " +
           std::to_string(bodies) + " bodies";
  }
  return {};
}

std::string find_order_fault(const char* min_name, Real min, const char* max_name, Real max) {
  if (min <= max) return {};
  return fault(min_name, min, std::string("at most ") + max_name + ", which is " + to_text(max));
}
std::string find_coupled_fault(const DistanceJoint& joint) {
  return find_order_fault("min_length", joint.min_length, "max_length", joint.max_length);
}
std::string find_coupled_fault(const BallJoint& joint) {
  return find_order_fault("min_twist", joint.min_twist, "max_twist", joint.max_twist);
}
std::string find_coupled_fault(const HingeJoint& joint) {
  return find_order_fault("min_angle", joint.min_angle, "max_angle", joint.max_angle);
}
std::string find_coupled_fault(const SliderJoint& joint) {
  return find_order_fault("min_position", joint.min_position, "max_position", joint.max_position);
}
std::string find_coupled_fault(const FixedJoint&) { return {}; }
std::string find_coupled_fault(const WheelJoint& joint) {
  return find_order_fault("min_position", joint.min_position, "max_position", joint.max_position);
}

/// The first fault of the joints of a scene.
std::string find_joint_fault(const Scene& scene) {
  if (!scene.joints.empty() && scene.solver != Solver::soft_step) {
    return "solver is worst_first; it must be soft_step for a scene with joints";
  }
  for (std::size_t i = 0; i < scene.joints.size(); ++i) {
    std::string found = find_fault(scene.joints[i]);
    const auto check = [&](const auto& joint) {
      bool any_movable = false;
      const auto check_body = [&](const char* field, const BodyId& body) {
        if (!found.empty()) return;
        if (body.index >= scene.bodies.size()) {
          found = std::string(field) + " is " + std::to_string(body.index) +
                  "; it must be an index of the scene's " + std::to_string(scene.bodies.size()) +
                  " bodies";
        } else {
          any_movable |= scene.bodies[body.index].mass > 0;
        }
      };
      check_body("a", joint.a);
      if (joint.b) check_body("b", *joint.b);
      if (!found.empty() || any_movable) return;
      found = "its bodies have mass 0; one of them must be movable";
    };
    std::visit(check, scene.joints[i]);
    if (!found.empty()) return "joints[" + std::to_string(i) + "]: " + found;
  }
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

std::string find_fault(const BodyState& state) { return find_field_fault(state); }
std::string find_fault(const Joint& joint) {
  return std::visit(
      [](const auto& j) {
        std::string found = find_field_fault(j);
        if (found.empty()) found = find_coupled_fault(j);
        if (found.empty() && j.b && j.a.index == j.b->index) {
          found = "b is body " + std::to_string(j.b->index) + "; it must be another body than a";
        }
        return found;
      },
      joint);
}
std::string find_range_fault(const BodyDef& def) { return find_field_fault(def); }

std::string find_mass_fault(Real mass) {
  if (!kNotNegative.contains(mass)) return fault("mass", mass, kNotNegative.text);
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

std::string find_locks_fault(const MotionLocks& locks, Solver solver) {
  if (locks == MotionLocks{} || solver == Solver::soft_step) return {};
  return "solver is worst_first; it must be soft_step for a body with motion_locks";
}

void validate_body(const BodyDef& def, std::uint64_t body, Solver solver) {
  std::string found = find_range_fault(def);
  if (found.empty()) found = find_coupled_fault(def);
  if (found.empty()) found = find_locks_fault(def.motion_locks, solver);
  if (!found.empty()) throw InvalidScene("body " + std::to_string(body) + ": " + found);
}

void validate_body_count(std::uint64_t bodies) {
  constexpr std::uint64_t kMax = std::numeric_limits<std::uint32_t>::max();
  if (bodies <= kMax) return;
  throw InvalidScene("the scene has " + std::to_string(bodies) + " bodies; it must have at most " +
                     std::to_string(kMax));
}

void validate(const Scene& scene) {
  std::string found = find_field_fault(scene);
  if (!found.empty()) throw InvalidScene("scene: " + found);
  validate_body_count(scene.bodies.size());
  for (std::size_t i = 0; i < scene.bodies.size(); ++i) {
    validate_body(scene.bodies[i], i, scene.solver);
  }
  found = find_pair_fault(scene.ignored_pairs, scene.bodies.size());
  if (found.empty()) found = find_joint_fault(scene);
  if (!found.empty()) throw InvalidScene("scene: " + found);
}

}  // namespace JFPX_ABI
}  // namespace jfpx
