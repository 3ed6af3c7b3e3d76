/// Calls of functions of World as JSON: an array of the name and the arguments.
#pragma once

#include <jfpx/recorded_world.hpp>

#include "src/scene/json_writer.hpp"

#include <concepts>
#include <type_traits>
#include <utility>

namespace jfpx {
inline namespace JFPX_ABI {

detail::SceneJson to_value(ForceId id);
detail::SceneJson to_value(JointId id);
detail::SceneJson to_value(const RecordableForce& force);

namespace recorded {

using Json = detail::SceneJson;

/// @throws InvalidArgument if a number is not finite
void require_finite(const Json& json);

/// The argument of a call. World::add() refuses a body with a number that is not finite.
/// @throws InvalidArgument for another argument with such a number
template <class T>
Json argument(const T& value) {
  Json json = to_value(value);
  if constexpr (!std::same_as<T, BodyDef>) require_finite(json);
  return json;
}

/// A call of the function `name`.
template <class... Arguments>
Json make_call(const char* name, const Arguments&... arguments) {
  return Json::array({name, argument(arguments)...});
}
/// Performs a call on a world.
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
