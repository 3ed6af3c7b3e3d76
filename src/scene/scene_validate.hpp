/// Validation of single bodies and states, and conversion of values to text for messages.
#pragma once

#include <jfpx/scene.hpp>

#include <cstdint>
#include <string>
#include <type_traits>

namespace jfpx {
inline namespace JFPX_ABI {

/// Checks all fields of a body.
/// @param body   index of the body in the scene (or in World::bodies()), for the message
/// @param solver of the scene
/// @throws InvalidScene
void validate_body(const BodyDef& def, std::uint64_t body, Solver solver);
/// @throws InvalidScene if the number of bodies exceeds the range of SphereIndex
void validate_body_count(std::uint64_t bodies);
/// Checks that the coordinates are within kMaxCoordinate, the velocities are finite and the
/// orientation has unit length to kUnitTolerance. Returns an empty string for a valid state,
/// otherwise a message with field, value and range, without the body.
std::string find_fault(const BodyState& state);
/// Checks all fields of a joint, except the existence of its bodies. Result as above.
std::string find_fault(const Joint& joint);
/// Checks each field of a body separately. Result as above.
std::string find_range_fault(const BodyDef& def);
/// Checks one field. Result as above.
template <class T>
std::string find_range_fault(T BodyDef::*field, const std::type_identity_t<T>& value) {
  BodyDef def;
  def.*field = value;
  return find_range_fault(def);
}
/// Checks conditions that ranges do not describe. Results as above.
JFPX_API std::string find_mass_fault(Real mass);
std::string find_inertia_fault(const Mat3& inertia);
/// Checks the inertia of a solid body with a valid shape that may be movable.
std::string find_inertia_fault(const Shape& shape, Real mass);
/// Checks that the solver knows the locks. Result as above.
std::string find_locks_fault(const MotionLocks& locks, Solver solver);
/// The shortest text that converts back to the same value.
JFPX_API std::string to_text(Real value);
JFPX_API std::string to_text(const Vec3& v);
JFPX_API std::string to_text(const Quat& q);
JFPX_API std::string to_text(const Mat3& m);
/// The number of an integer or of a value of an enumeration.
template <class T>
requires std::is_integral_v<T> || std::is_enum_v<T> std::string to_text(T value) {
  return to_text(static_cast<Real>(value));
}

}  // namespace JFPX_ABI
}  // namespace jfpx
