/// Calls of functions of World as JSON.
#include "src/world/recording/recorded_calls.hpp"

#include "src/scene/joint_fields.hpp"
#include "src/scene/scene_json.hpp"
#include "src/world/forces/force_fields.hpp"

#include <algorithm>
#include <array>
#include <concepts>
#include <functional>
#include <string>
#include <tuple>

namespace jfpx {
inline namespace JFPX_ABI {
namespace recorded {
namespace {

[[noreturn]] void refuse(const std::string& what) { throw InvalidScene(what); }

/// Names of the forces, in the order of RecordableForce.
constexpr std::array<const char*, std::variant_size_v<RecordableForce>> kForceNames{
    "gravity", "drag", "spring", "bungee", "aero", "aero_control", "buoyancy", "explosion"};

void read(const Json& json, Real& value) { value = json.get<Real>(); }
void read(const Json& json, bool& value) { value = json.get<bool>(); }
void read(const Json& json, std::uint32_t& value) {
  if (!json.is_number_unsigned() || json.get<std::uint64_t>() > 0xffffffffu) {
    refuse("a call has a number that is not a whole number of 32 bits");
  }
  value = json.get<std::uint32_t>();
}
void read(const Json& json, std::uint64_t& value) {
  if (!json.is_number_unsigned()) refuse("a call has a number that is not a whole number");
  value = json.get<std::uint64_t>();
}
void read(const Json& json, Vec3& v) {
  for (int i = 0; i < 3; ++i) read(json.at(static_cast<std::size_t>(i)), v[i]);
}
void read(const Json& json, Quat& q) {
  read(json.at(0), q.w), read(json.at(1), q.x), read(json.at(2), q.y), read(json.at(3), q.z);
}
void read(const Json& json, Mat3& m) {
  for (std::size_t i = 0; i < 3; ++i) read(json.at(i), m.row[i]);
}
void read(const Json& json, BodyId& id) {
  read(json.at(0), id.index);
  read(json.at(1), id.generation);
}
void read(const Json& json, JointId& id) {
  read(json.at(0), id.index);
  read(json.at(1), id.generation);
}
void read(const Json& json, ForceId& id) { read(json, id.number); }
void read(const Json& json, BodyDef& body) { body = body_from_value(json); }
template <class T>
void read(const Json& json, std::optional<T>& value) {
  value.reset();
  if (!json.is_null()) read(json, value.emplace());
}
template <HasFields T>
void read(const Json& json, T& value) {
  each_field(value, [&]<class Field>(const Field& field, auto& member) {
    if (Field::kPresence == Presence::newer && !json.contains(field.name)) return;
    read(json.at(field.name), member);
  });
}
template <class... T>
void read_joint(const Json& json, std::variant<T...>& joint) {
  const std::string name = json.at("type").get<std::string>();
  const bool is_read =
      ((name == kJointName<T> && (read(json, joint.template emplace<T>()), true)) || ...);
  if (!is_read) refuse("there is no joint \"" + name + "\"");
}
void read(const Json& json, Joint& joint) { read_joint(json, joint); }
template <std::size_t... I>
void read_force(const Json& json, RecordableForce& force, std::index_sequence<I...>) {
  const std::string name = json.at("type").get<std::string>();
  const auto read_if = [&](auto index) {
    constexpr std::size_t i = decltype(index)::value;
    if (name == kForceNames[i]) read(json, force.emplace<i>());
    return name == kForceNames[i];
  };
  if (!(read_if(std::integral_constant<std::size_t, I>()) || ...)) {
    refuse("there is no force \"" + name + "\"");
  }
}
void read(const Json& json, RecordableForce& force) {
  read_force(json, force, std::make_index_sequence<kForceNames.size()>());
}

/// A function that a recorded call may name.
template <class Function>
struct Named {
  const char* name;
  Function function;
};
template <class Function>
Named(const char*, Function) -> Named<Function>;

constexpr std::tuple kFunctions{
    Named{"add", &World::add},
    Named{"remove", &World::remove},
    Named{"replace", &World::replace},
    Named{"set_state", &World::set_state},
    Named{"wake", &World::wake},
    Named{"set_friction", &World::set_friction},
    Named{"set_restitution", &World::set_restitution},
    Named{"set_acceleration", &World::set_acceleration},
    Named{"set_damping", &World::set_damping},
    Named{"set_mass", &World::set_mass},
    Named{"set_inertia", &World::set_inertia},
    Named{"set_motion_locks", &World::set_motion_locks},
    Named{"set_user_data", &World::set_user_data},
    Named{"set_filter", &World::set_filter},
    Named{"set_pair_ignored", &World::set_pair_ignored},
    Named{"apply_force", &World::apply_force},
    Named{"apply_force_at_point", &World::apply_force_at_point},
    Named{"apply_torque", &World::apply_torque},
    Named{"apply_impulse", &World::apply_impulse},
    Named{"apply_impulse_at_point", &World::apply_impulse_at_point},
    Named{"apply_angular_impulse", &World::apply_angular_impulse},
    Named{"add_force", &add_force},
    Named{"set_force", &set_force},
    Named{"remove_force", &World::remove_force},
    Named{"add_joint", &World::add_joint},
    Named{"set_joint", &World::set_joint},
    Named{"remove_joint", &World::remove_joint},
};

/// Reads the arguments and calls the function.
template <class Function, class... Arguments>
void call_with(World& world, const Json& call, Function function,
               std::tuple<Arguments...> arguments) {
  std::size_t count = 0;
  std::apply([&](auto&... argument) { (read(call.at(++count), argument), ...); }, arguments);
  if (call.size() != count + 1) refuse("a call has too many arguments");
  std::apply([&](const auto&... argument) { std::invoke(function, world, argument...); },
             arguments);
}
template <class Result, class... Parameters>
void read_and_call(World& world, const Json& call, Result (World::*function)(Parameters...)) {
  call_with(world, call, function, std::tuple<std::remove_cvref_t<Parameters>...>());
}
template <class Result, class... Parameters>
void read_and_call(World& world, const Json& call, Result (*function)(World&, Parameters...)) {
  call_with(world, call, function, std::tuple<std::remove_cvref_t<Parameters>...>());
}

}  // namespace

void require_finite(const Json& json) {
  for (const Json& item : json) {
    if (item.is_structured()) require_finite(item);
    if (!item.is_number_float() || is_finite(item.get<Real>())) continue;
    throw InvalidArgument("a recorded call has a number that is not finite");
  }
}

ForceId add_force(World& world, const RecordableForce& force) {
  return std::visit([&](const auto& value) { return world.add_force(value); }, force);
}

void set_force(World& world, ForceId id, const RecordableForce& force) {
  std::visit([&]<class F>(const F& value) { world.force<F>(id) = value; }, force);
}

void make_call_on(World& world, const Json& call) {
  const std::string name = call.at(0).get<std::string>();
  const auto call_if = [&](const auto& named) {
    if (name == named.name) read_and_call(world, call, named.function);
    return name == named.name;
  };
  if (!std::apply([&](const auto&... named) { return (call_if(named) || ...); }, kFunctions)) {
    refuse("there is no function \"" + name + "\"");
  }
}

}  // namespace recorded

detail::SceneJson to_value(ForceId id) { return id.number; }
detail::SceneJson to_value(JointId id) {
  return detail::SceneJson::array({id.index, id.generation});
}
detail::SceneJson to_value(const RecordableForce& force) {
  detail::SceneJson json = {{"type", recorded::kForceNames[force.index()]}};
  std::visit([&json](const auto& value) { add_fields(&json, value); }, force);
  return json;
}

}  // namespace JFPX_ABI
}  // namespace jfpx
