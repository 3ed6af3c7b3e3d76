/// Strict reader of the JSON form of scenes and recording headers. Errors contain the name of the
/// faulty field.
#include "src/scene/scene_json.hpp"

#include <jfpx/error.hpp>

#include "src/base/file.hpp"
#include "src/collide/shapes.hpp"
#include "src/scene/joint_fields.hpp"
#include "src/scene/scene_fields.hpp"
#include "src/scene/scene_json_value.hpp"

#include <algorithm>
#include <optional>
#include <set>
#include <string>
#include <type_traits>
#include <variant>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace {

using Json = detail::SceneJson;
using detail::kShapeName;

[[noreturn]] void fail(const std::string& where, const std::string& what) {
  throw InvalidScene(where + ": " + what);
}

const char* kind_of(const Json& value) {
  if (value.is_array()) return "an array";
  if (value.is_object()) return "an object";
  if (value.is_string()) return "a string";
  if (value.is_boolean()) return "a boolean";
  return value.is_null() ? "null" : "a number";
}

/// Text of a value for a message. Arrays and objects are reported by kind only, because writing
/// them recurses once per nesting level.
std::string text_of(const Json& json) { return json.is_structured() ? kind_of(json) : json.dump(); }

void read(const Json& json, const std::string& where, Real& out) {
  if (!json.is_number()) fail(where, std::string("is ") + kind_of(json) + "; it must be a number");
  out = json.get<Real>();
}
void read(const Json& json, const std::string& where, bool& out) {
  if (!json.is_boolean())
    fail(where, std::string("is ") + kind_of(json) + "; it must be a boolean");
  out = json.get<bool>();
}
void read(const Json& json, const std::string& where, std::string& out) {
  if (!json.is_string()) fail(where, std::string("is ") + kind_of(json) + "; it must be a string");
  out = json.get<std::string>();
}
void read(const Json& json, const std::string& where, std::uint32_t& out) {
  if (!json.is_number_unsigned() || json.get<std::uint64_t>() > 0xffffffffu) {
    fail(where, "is " + text_of(json) + "; it must be a whole number from 0 to 4294967295");
  }
  out = json.get<std::uint32_t>();
}
void read(const Json& json, const std::string& where, std::uint64_t& out) {
  if (!json.is_number_unsigned()) {
    fail(where, "is " + text_of(json) + "; it must be a whole number from 0 to 2^64 - 1");
  }
  out = json.get<std::uint64_t>();
}
/// An enumeration whose to_string() returns null beyond the last value.
template <class Enum>
requires std::is_enum_v<Enum>
void read(const Json& json, const std::string& where, Enum& out) {
  std::string name, names;
  read(json, where, name);
  for (std::uint8_t i = 0; to_string(Enum{i}) != nullptr; ++i) {
    out = Enum{i};
    if (name == to_string(out)) return;
    names += (i == 0 ? "" : ", ") + std::string(to_string(out));
  }
  fail(where, "is " + text_of(json) + "; it must be one of " + names);
}
void read_array(const Json& json, const std::string& where, std::span<Real* const> out) {
  if (!json.is_array() || json.size() != out.size()) {
    fail(where, "must be an array of " + std::to_string(out.size()) + " numbers");
  }
  for (std::size_t i = 0; i < out.size(); ++i) {
    read(json[i], where + "[" + std::to_string(i) + "]", *out[i]);
  }
}
void read(const Json& json, const std::string& where, Vec3& v) {
  Real* const parts[] = {&v.x, &v.y, &v.z};
  read_array(json, where, parts);
}
void read(const Json& json, const std::string& where, std::optional<Mat3>& m) {
  if (!json.is_array() || json.size() != 3) fail(where, "must be an array of 3 rows");
  m.emplace();
  for (std::size_t i = 0; i < 3; ++i) {
    read(json[i], where + "[" + std::to_string(i) + "]", m->row[i]);
  }
}
void read(const Json& json, const std::string& where, Quat& q) {
  Real* const parts[] = {&q.w, &q.x, &q.y, &q.z};
  read_array(json, where, parts);
}

template <HasFields T>
void read(const Json& json, const std::string& where, T& object);
template <class... Shapes>
void read(const Json& json, const std::string& where, std::variant<Shapes...>& shape);
template <class T>
void read(const Json& json, const std::string& where, std::vector<T>& list);
void read(const Json& json, const std::string& where, BodyId& body);
void read(const Json& json, const std::string& where, std::optional<BodyId>& body);

/// Reads the fields of one object and rejects unknown fields.
class ObjectReader {
 public:
  ObjectReader(const Json& json, std::string where) : json_(json), where_(std::move(where)) {
    if (!json.is_object())
      fail(where_, std::string("is ") + kind_of(json) + "; it must be an object");
  }
  template <typename T>
  void required(const char* name, T& out) {
    read(at(name), path(name), out);
  }
  /// Reads the fields of each_field().
  template <HasFields T>
  void fields(T& object) {
    each_field(object, [this]<class Field>(const Field& field, auto& member) {
      const bool is_required = Field::kPresence == Presence::required;
      const Json* value = is_required ? &at(field.name) : find(field.name);
      if (value != nullptr) read(*value, path(field.name), member);
    });
  }
  const Json* find(const char* name) {
    known_.insert(name);
    const auto it = json_.find(name);
    return it == json_.end() ? nullptr : &*it;
  }
  const Json& at(const char* name) {
    const Json* value = find(name);
    if (value == nullptr) fail(where_, std::string("has no field \"") + name + "\"");
    return *value;
  }
  std::string path(const char* name) const { return where_ + "." + name; }
  void reject_unknown() const {
    for (const auto& item : json_.items()) {
      if (known_.contains(item.key())) continue;
      std::string names;
      for (const std::string& name : known_) names += (names.empty() ? "" : ", ") + name;
      const char* const hint =
          item.key() == "gravity" ? "; gravity is the field \"acceleration\" of each body" : "";
      fail(where_, "has an unknown field \"" + item.key() + "\"; known fields are " + names + hint);
    }
  }

 private:
  const Json& json_;
  std::string where_;
  std::set<std::string> known_;
};

template <HasFields T>
void read(const Json& json, const std::string& where, T& object) {
  ObjectReader reader(json, where);
  reader.fields(object);
  reader.reject_unknown();
}

/// Name of a shape or a joint.
template <class T>
inline constexpr const char* kTypeName = kShapeName<T>;
template <>
inline constexpr const char* kTypeName<DistanceJoint> = kJointName<DistanceJoint>;
template <>
inline constexpr const char* kTypeName<BallJoint> = kJointName<BallJoint>;
template <>
inline constexpr const char* kTypeName<HingeJoint> = kJointName<HingeJoint>;
template <>
inline constexpr const char* kTypeName<SliderJoint> = kJointName<SliderJoint>;
template <>
inline constexpr const char* kTypeName<FixedJoint> = kJointName<FixedJoint>;
template <>
inline constexpr const char* kTypeName<WheelJoint> = kJointName<WheelJoint>;

/// True if `type` is the name of shape or joint T. Version 0.1 named a compound "assembly".
template <class T>
bool is_name_of(const std::string& type) {
  return type == kTypeName<T> || (std::is_same_v<T, Compound> && type == "assembly");
}

/// Reads a shape or joint whose type is in the field "type".
template <class... Types>
void read(const Json& json, const std::string& where, std::variant<Types...>& out) {
  ObjectReader object(json, where);
  std::string type;
  object.required("type", type);
  const auto read_if = [&](auto value) {
    if (!is_name_of<decltype(value)>(type)) return false;
    try {
      object.fields(value);
    } catch (const InvalidArgument& error) {  // by the constructor of a shape
      fail(where, error.what());
    }
    out = std::move(value);
    return true;
  };
  if (!(read_if(Types{}) || ...)) {
    std::string names;
    std::size_t left = sizeof...(Types);
    const auto list = [&](const char* name) {
      names += names.empty() ? "" : left == 1 ? " or " : ", ";
      names += name;
      --left;
    };
    (list(kTypeName<Types>), ...);
    fail(object.path("type"), "is \"" + type + "\"; it must be " + names);
  }
  object.reject_unknown();
}

/// Reads a body of a joint: its index in the scene.
void read(const Json& json, const std::string& where, BodyId& body) {
  body = {};
  read(json, where, body.index);
}
void read(const Json& json, const std::string& where, std::optional<BodyId>& body) {
  read(json, where, body.emplace());
}

void read(const Json& json, const std::string& where, Triangle& triangle) {
  if (!json.is_array() || json.size() != 3) {
    fail(where, "must be an array of 3 indices of vertices");
  }
  for (std::size_t i = 0; i < 3; ++i) {
    read(json[i], where + "[" + std::to_string(i) + "]", triangle[i]);
  }
}
void read(const Json& json, const std::string& where, BodyPair& pair) {
  if (!json.is_array() || json.size() != 2) fail(where, "must be an array of 2 indices of bodies");
  read(json[0], where + "[0]", pair.a);
  read(json[1], where + "[1]", pair.b);
}

template <class T>
void read(const Json& json, const std::string& where, std::vector<T>& list) {
  if (!json.is_array()) fail(where, std::string("is ") + kind_of(json) + "; it must be an array");
  list.clear();
  for (const Json& item : json) {
    const std::string place = where + "[" + std::to_string(list.size()) + "]";
    read(item, place, list.emplace_back());
  }
}
Scene scene_from(const Json& json) {
  ObjectReader object(json, "scene");
  const Json& version = object.at("jfpx_scene");
  if (version != kSceneSchemaVersion && version != 1) {
    fail("scene.jfpx_scene", "is " + text_of(version) +
                                 "; this build reads schema versions 1 and " +
                                 std::to_string(kSceneSchemaVersion));
  }
  Scene scene;
  if (version == 1) scene.solver = Solver::worst_first;  // the only solver of that version
  object.fields(scene);
  if (const Json* pairs = object.find("ignored_pairs")) {
    read(*pairs, object.path("ignored_pairs"), scene.ignored_pairs);
  }
  if (const Json* joints = object.find("joints")) {
    read(*joints, object.path("joints"), scene.joints);
  }
  const Json& bodies = object.at("bodies");
  if (!bodies.is_array())
    fail("scene.bodies", std::string("is ") + kind_of(bodies) + "; it must be an array");
  scene.bodies.reserve(bodies.size());
  for (const Json& json_body : bodies) {
    const std::string where = "body " + std::to_string(scene.bodies.size());
    read(json_body, where, scene.bodies.emplace_back());
  }
  object.reject_unknown();
  validate(scene);
  return scene;
}

/// Rejects deep nesting. The parser does not recurse, but copying and writing a parsed value does.
void require_shallow(std::string_view text) {
  constexpr int kDeepest = 64;
  int depth = 0;
  bool in_string = false;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const char c = text[i];
    if (c == '"') in_string = !in_string;
    if (in_string && c == '\\') ++i;  // skips the escaped character
    if (in_string) continue;
    if (c == '[' || c == '{') ++depth;
    if (c == ']' || c == '}') --depth;
    if (depth > kDeepest) {
      throw InvalidScene("arrays and objects are nested more than " + std::to_string(kDeepest) +
                         " deep");
    }
  }
}

/// Parser callback that rejects duplicate keys of an object.
class UniqueKeys {
 public:
  bool operator()(int, Json::parse_event_t event, const Json& parsed) {
    if (event == Json::parse_event_t::object_start) keys_.emplace_back();
    if (event == Json::parse_event_t::object_end) keys_.pop_back();
    if (event == Json::parse_event_t::key) {
      const auto& key = parsed.get_ref<const std::string&>();
      if (std::ranges::find(keys_.back(), key) != keys_.back().end()) {
        throw InvalidScene("\"" + key + "\" is given twice in one object");
      }
      keys_.back().push_back(key);
    }
    return true;
  }

 private:
  std::vector<std::vector<std::string>> keys_;  ///< of the enclosing objects
};

Json parse(std::string_view text) {
  require_shallow(text);
  try {
    return Json::parse(text, UniqueKeys());
  } catch (const nlohmann::json::exception& error) {
    // "[json.exception.parse_error.101] parse error at line 1, column 2: ..."
    const std::string what = error.what();
    const std::size_t end = what.find("] ");
    throw InvalidScene("broken JSON: " + (end == std::string::npos ? what : what.substr(end + 2)));
  }
}

}  // namespace

Json parse_json(std::string_view text) { return parse(text); }

Scene scene_from_value(const Json& json) { return scene_from(json); }

BodyDef body_from_value(const Json& json) {
  BodyDef body;
  read(json, "body", body);
  return body;
}

Scene from_json(std::string_view text) { return scene_from(parse(text)); }

Scene load_scene(const std::string& path) {
  const std::string text = read_file(path);
  try {
    return from_json(text);
  } catch (const InvalidScene& error) {
    throw InvalidScene(path + ": " + error.what());
  }
}

RecordingHeader recording_header_from_json(std::string_view text) {
  const Json json = parse(text);
  ObjectReader object(json, "recording");
  RecordingHeader header;
  object.required("engine", header.engine);
  object.required("backend", header.backend);
  if (header.backend == "x86") header.backend = "cpu";  // its name in version 0.1
  header.scene = scene_from(object.at("scene"));
  object.reject_unknown();
  return header;
}

}  // namespace JFPX_ABI
}  // namespace jfpx
