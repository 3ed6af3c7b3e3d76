/// Writer of the JSON form of scenes and recording headers, which preserves every bit.
#include <jfpx/error.hpp>

#include "src/base/file.hpp"
#include "src/scene/scene_json.hpp"
#include "src/scene/scene_json_value.hpp"

#include <string>
#include <variant>

namespace jfpx {
inline namespace JFPX_ABI {
namespace {

using Json = detail::SceneJson;
using detail::kTypeName;

Json to_value(const Vec3& v) { return Json::array({v.x, v.y, v.z}); }
Json to_value(const Quat& q) { return Json::array({q.w, q.x, q.y, q.z}); }

template <class... Shapes>
Json to_value(const std::variant<Shapes...>& shape);

/// The text as a JSON string. JSON is UTF-8, but a name may contain any bytes; invalid sequences
/// are replaced.
std::string quoted(const std::string& text) {
  return Json(text).dump(-1, ' ', false, Json::error_handler_t::replace);
}

Json fields_of(const Sphere& s) { return {{"radius", s.radius}}; }
Json fields_of(const Box& b) { return {{"half_extents", to_value(b.half_extents)}}; }
Json fields_of(const HalfSpace& h) {
  return {{"normal", to_value(h.normal)}, {"offset", h.offset}};
}
Json fields_of(const Plane& p) { return {{"normal", to_value(p.normal)}, {"offset", p.offset}}; }
Json fields_of(const Compound& compound) {
  Json parts = Json::array();
  for (const CompoundPart& part : compound.parts) {
    parts.push_back({{"shape", to_value(part.shape)},
                     {"position", to_value(part.position)},
                     {"orientation", to_value(part.orientation)},
                     {"density", part.density}});
  }
  return {{"parts", parts}};
}

template <class... Shapes>
Json to_value(const std::variant<Shapes...>& shape) {
  return std::visit(
      []<class T>(const T& value) {
        Json json = {{"type", kTypeName<T>}};
        json.update(fields_of(value));
        return json;
      },
      shape);
}

Json to_value(const BodyDef& b) {
  Json json = {{"shape", to_value(b.shape)},
               {"mass", b.mass},
               {"kinematic", b.kinematic},
               {"position", to_value(b.position)},
               {"orientation", to_value(b.orientation)},
               {"velocity", to_value(b.velocity)},
               {"angular_velocity", to_value(b.angular_velocity)},
               {"acceleration", to_value(b.acceleration)},
               {"linear_damping", b.linear_damping},
               {"angular_damping", b.angular_damping},
               {"friction", b.friction},
               {"restitution", b.restitution},
               {"can_sleep", b.can_sleep}};
  if (b.inertia) {
    const auto& row = b.inertia->row;
    json["inertia"] = Json::array({to_value(row[0]), to_value(row[1]), to_value(row[2])});
  }
  // Newer fields are left out where they have their defaults, so that older versions read the file.
  if (b.filter != CollisionFilter{}) {
    json["filter"] = {{"category", b.filter.category}, {"mask", b.filter.mask}};
  }
  if (b.rolling_friction > 0) json["rolling_friction"] = b.rolling_friction;
  if (b.spinning_friction > 0) json["spinning_friction"] = b.spinning_friction;
  if (b.sensor) json["sensor"] = true;
  if (b.user_data != 0) json["user_data"] = b.user_data;
  return json;
}

}  // namespace

Json body_to_value(const BodyDef& body) { return to_value(body); }

std::string to_json(const Scene& scene) {
  validate(scene);
  const SoftStepSettings& s = scene.soft_step;
  const Json soft_step = {{"substeps", s.substeps},
                          {"contact_hertz", s.contact_hertz},
                          {"damping_ratio", s.damping_ratio},
                          {"push_out_speed", s.push_out_speed},
                          {"restitution_threshold", s.restitution_threshold},
                          {"speculative_margin", s.speculative_margin}};
  const ResolverSettings& r = scene.resolver;
  const Json resolver = {{"max_iterations", r.max_iterations},
                         {"velocity_epsilon", r.velocity_epsilon},
                         {"position_epsilon", r.position_epsilon},
                         {"restitution_velocity", r.restitution_velocity},
                         {"angular_limit", r.angular_limit}};
  const Json sleep = {{"enabled", scene.sleep.enabled},
                      {"speed", scene.sleep.speed},
                      {"time", scene.sleep.time},
                      {"epsilon", scene.sleep.epsilon},
                      {"bias", scene.sleep.bias}};
  const Json materials = {{"friction", to_string(scene.materials.friction)},
                          {"restitution", to_string(scene.materials.restitution)}};
  std::string pairs;
  if (!scene.ignored_pairs.empty()) {
    Json list = Json::array();
    for (const BodyPair& pair : scene.ignored_pairs) list.push_back({pair.a, pair.b});
    pairs = ",\n \"ignored_pairs\": " + list.dump();
  }
  // The outer structure is written by hand, so that a file has one line per body.
  std::string text = "{\"jfpx_scene\": " + std::to_string(kSceneSchemaVersion) +
                     ",\n \"name\": " + quoted(scene.name) +
                     ",\n \"dt\": " + Json(scene.dt).dump() + ",\n \"solver\": \"" +
                     to_string(scene.solver) + "\",\n \"soft_step\": " + soft_step.dump() +
                     ",\n \"resolver\": " + resolver.dump() + ",\n \"sleep\": " + sleep.dump() +
                     ",\n \"materials\": " + materials.dump() + pairs + ",\n \"bodies\": [";
  for (std::size_t i = 0; i < scene.bodies.size(); ++i) {
    text += (i == 0 ? "\n  " : ",\n  ") + to_value(scene.bodies[i]).dump();
  }
  return text + "\n]}\n";
}

void save_scene(const Scene& scene, const std::string& path) { write_file(path, to_json(scene)); }

std::string recording_header_to_json(const RecordingHeader& header) {
  return "{\"engine\": " + quoted(header.engine) + ", \"backend\": " + quoted(header.backend) +
         ", \"scene\": " + to_json(header.scene) + "}";
}

}  // namespace JFPX_ABI
}  // namespace jfpx
