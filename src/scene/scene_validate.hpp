/// Checks of single parts of a scene, for those who add them one by one.
#pragma once

#include <jfpx/scene.hpp>

#include <cstdint>
#include <string>

namespace jfpx {
inline namespace JFPX_ABI {

/// @param body position in the scene, for the message @throws InvalidScene
void validate_body(const BodyDef& def, std::uint64_t body);
/// @throws InvalidScene if a SphereIndex could not count them
void validate_body_count(std::uint64_t bodies);
/// Position and velocities finite and in range, orientation of unit length. Empty if so, else
/// what is wrong, without naming the body.
std::string find_fault(const BodyState& state);
/// The shortest text that reads back as `value`, for messages.
std::string to_text(Real value);
std::string to_text(const Vec3& v);
std::string to_text(const Quat& q);
std::string to_text(const Mat3& m);

}  // namespace JFPX_ABI
}  // namespace jfpx
