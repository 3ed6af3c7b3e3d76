/// Writer of the JSON form of scenes and recording headers, which preserves every bit.
#include "src/base/file.hpp"
#include "src/scene/json_writer.hpp"
#include "src/scene/scene_json.hpp"

#include <string>

namespace jfpx {
inline namespace JFPX_ABI {
namespace {

using Json = detail::SceneJson;

/// JSON is UTF-8, but a name may contain any bytes; invalid sequences are replaced.
std::string dumped(const Json& json) {
  return json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

/// A joint of a scene, whose bodies are indices.
Json joint_value(const Joint& joint) {
  Json json = to_value(joint);
  std::visit(
      [&json](const auto& j) {
        json["a"] = j.a.index;
        if (j.b) json["b"] = j.b->index;
      },
      joint);
  return json;
}

}  // namespace

std::string to_json(const Scene& scene) {
  validate(scene);
  // The outer structure is written by hand, so that a file has one line per body.
  std::string text = "{\"jfpx_scene\": " + std::to_string(kSceneSchemaVersion);
  const auto add = [&text](const char* name, const std::string& value) {
    text += std::string(",\n \"") + name + "\": " + value;
  };
  each_field(scene, [&add](const auto& field, const auto& member) {
    add(field.name, dumped(to_value(member)));
  });
  if (!scene.ignored_pairs.empty()) add("ignored_pairs", dumped(to_value(scene.ignored_pairs)));
  const auto add_list = [&](const char* name, const auto& items, const auto& value_of) {
    add(name, "[");
    for (std::size_t i = 0; i < items.size(); ++i) {
      text += (i == 0 ? "\n  " : ",\n  ") + dumped(value_of(items[i]));
    }
    text += "\n]";
  };
  if (!scene.joints.empty()) add_list("joints", scene.joints, joint_value);
  add_list("bodies", scene.bodies, [](const BodyDef& body) { return to_value(body); });
  return text + "}\n";
}

void save_scene(const Scene& scene, const std::string& path) { write_file(path, to_json(scene)); }

std::string recording_header_to_json(const RecordingHeader& header) {
  return "{\"engine\": " + dumped(header.engine) + ", \"backend\": " + dumped(header.backend) +
         ", \"scene\": " + to_json(header.scene) + "}";
}

}  // namespace JFPX_ABI
}  // namespace jfpx
