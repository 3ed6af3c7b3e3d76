/// Values of public types as JSON, which preserves every bit.
#pragma once

#include "src/collide/shapes.hpp"
#include "src/scene/joint_fields.hpp"
#include "src/scene/scene_fields.hpp"
#include "src/scene/scene_json_value.hpp"

#include <optional>
#include <string>
#include <type_traits>
#include <variant>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {

template <class T>
requires std::is_arithmetic_v<T> detail::SceneJson to_value(T value) { return value; }
/// An enumeration with names.
template <class T>
requires std::is_enum_v<T> detail::SceneJson to_value(T value) { return to_string(value); }
inline detail::SceneJson to_value(const std::string& text) { return text; }
inline detail::SceneJson to_value(const Vec3& v) {
  return detail::SceneJson::array({v.x, v.y, v.z});
}
inline detail::SceneJson to_value(const Quat& q) {
  return detail::SceneJson::array({q.w, q.x, q.y, q.z});
}
inline detail::SceneJson to_value(const Mat3& m) {
  return detail::SceneJson::array({to_value(m.row[0]), to_value(m.row[1]), to_value(m.row[2])});
}
inline detail::SceneJson to_value(const Triangle& triangle) {
  return detail::SceneJson::array({triangle[0], triangle[1], triangle[2]});
}
inline detail::SceneJson to_value(const BodyPair& pair) {
  return detail::SceneJson::array({pair.a, pair.b});
}
inline detail::SceneJson to_value(BodyId id) {
  return detail::SceneJson::array({id.index, id.generation});
}
template <class... Shapes>
detail::SceneJson to_value(const std::variant<Shapes...>& shape);
template <class T>
detail::SceneJson to_value(const std::optional<T>& value) {
  return value ? to_value(*value) : detail::SceneJson();
}
template <class T>
detail::SceneJson to_value(const std::vector<T>& list) {
  detail::SceneJson json = detail::SceneJson::array();
  for (const T& item : list) json.push_back(to_value(item));
  return json;
}

/// Adds the fields of each_field() to an object.
template <HasFields T>
void add_fields(detail::SceneJson* json, const T& object) {
  each_field(object, [json]<class Field, class Member>(const Field& field, const Member& member) {
    if constexpr (Field::kPresence == Presence::newer) {
      if (member == Member{}) return;
    }
    (*json)[field.name] = to_value(member);
  });
}
template <HasFields T>
detail::SceneJson to_value(const T& object) {
  detail::SceneJson json = detail::SceneJson::object();
  add_fields(&json, object);
  return json;
}
/// The fields of an object, after the name of its type.
template <HasFields T>
detail::SceneJson named_value(const char* type, const T& object) {
  detail::SceneJson json = {{"type", type}};
  add_fields(&json, object);
  return json;
}
template <class... Shapes>
detail::SceneJson to_value(const std::variant<Shapes...>& shape) {
  return std::visit(
      []<class T>(const T& value) { return named_value(detail::kShapeName<T>, value); }, shape);
}
inline detail::SceneJson to_value(const Joint& joint) {
  return std::visit([]<class T>(const T& value) { return named_value(kJointName<T>, value); },
                    joint);
}

}  // namespace JFPX_ABI
}  // namespace jfpx
