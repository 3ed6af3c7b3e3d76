/// Validation of single bodies and states, and conversion of values to text for messages.
#pragma once

#include <jfpx/scene.hpp>

#include <cstdint>
#include <string>

namespace jfpx {
inline namespace JFPX_ABI {

/// Checks all fields of a body.
/// @param body index of the body in the scene (or in World::bodies()), for the message
/// @throws InvalidScene
void validate_body(const BodyDef& def, std::uint64_t body);
/// @throws InvalidScene if the number of bodies exceeds the range of SphereIndex
void validate_body_count(std::uint64_t bodies);
/// Checks that the coordinates are within kMaxCoordinate, the velocities are finite and the
/// orientation has unit length to kUnitTolerance. Returns an empty string for a valid state, else a
/// message with field, value and range, without the body.
std::string find_fault(const BodyState& state);
/// Checks of single fields of a body, with results as those of find_fault().
std::string find_mass_fault(Real mass);
std::string find_inertia_fault(const Mat3& inertia);
/// Checks the inertia of a solid body of a valid shape that can be movable.
std::string find_inertia_fault(const Shape& shape, Real mass);
std::string find_acceleration_fault(const Vec3& acceleration);
std::string find_damping_fault(Real linear, Real angular);
std::string find_friction_fault(Real friction);
std::string find_restitution_fault(Real restitution);
/// The shortest text that converts back to the same value.
std::string to_text(Real value);
std::string to_text(const Vec3& v);
std::string to_text(const Quat& q);
std::string to_text(const Mat3& m);

}  // namespace JFPX_ABI
}  // namespace jfpx
