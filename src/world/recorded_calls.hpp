/// Calls of functions of World as JSON: an array of the name and the arguments.
#pragma once

#include <jfpx/recorded_world.hpp>

#include "src/scene/scene_json_value.hpp"

#include <type_traits>
#include <utility>

namespace jfpx {
inline namespace JFPX_ABI {
namespace recorded {

using Json = detail::SceneJson;

Json to_value(Real value);
Json to_value(bool value);
Json to_value(std::uint64_t value);
Json to_value(const Vec3& v);
Json to_value(const std::optional<Mat3>& m);
Json to_value(BodyId id);
Json to_value(ForceId id);
Json to_value(const BodyDef& body);
Json to_value(const BodyState& state);
Json to_value(const CollisionFilter& filter);
Json to_value(const RecordableForce& force);
Json to_value(std::uint32_t value);
Json to_value(const Quat& q);
Json to_value(const Mat3& m);
Json to_value(const std::optional<BodyId>& id);
Json to_value(const Attachment& attachment);
Json to_value(const HalfSpace& half_space);

/// A call of the function `name`.
template <class... Arguments>
Json make_call(const char* name, const Arguments&... arguments) {
  return Json::array({name, to_value(arguments)...});
}
/// Makes a call on a world.
/// @throws nlohmann::json::exception or InvalidScene for a value that is not a call, and the
///   exceptions of the function of World
void make_call_on(World& world, const Json& call);

/// Adds a force to a world.
ForceId add_force(World& world, const RecordableForce& force);
/// Replaces a force. @throws InvalidArgument as World::force()
void set_force(World& world, ForceId id, const RecordableForce& force);

}  // namespace recorded
}  // namespace JFPX_ABI
}  // namespace jfpx
