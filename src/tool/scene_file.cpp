/// Reads scene files and the files of meshes that they name.
#include "src/tool/scene_file.hpp"

#include <jfpx/error.hpp>

#include "src/base/file.hpp"
#include "src/base/system.hpp"
#include "src/scene/scene_json_value.hpp"
#include "src/tool/mesh_file.hpp"

#include <filesystem>
#include <map>
#include <tuple>
#include <utility>

namespace jfpx {
inline namespace JFPX_ABI {
namespace tool {
namespace {

using Json = detail::SceneJson;

/// The shape of a body in a file.
struct FileShape {
  std::size_t body = 0;
  std::string file;  ///< the path, for messages as in the scene
  Real scale = 1;
  bool is_hull = false, two_sided = false;
};

[[noreturn]] void fail_shape(std::size_t body, const std::string& what) {
  throw InvalidScene("body " + std::to_string(body) + ".shape" + what);
}

/// @param json an object with the field "file"
FileShape file_shape(std::size_t body, const Json& json) {
  FileShape shape;
  shape.body = body;
  const auto type = json.find("type");
  const bool has_type = type != json.end() && type->is_string();
  shape.is_hull = has_type && *type == "hull";
  if (!shape.is_hull && !(has_type && *type == "triangle_mesh")) {
    fail_shape(body, ".file: only shapes of type triangle_mesh or hull have a file");
  }
  for (const auto& [name, value] : json.items()) {
    if (name == "type") continue;
    if (name == "file") {
      if (!value.is_string()) fail_shape(body, ".file: must be a string");
      shape.file = value.get<std::string>();
    } else if (name == "scale") {
      const Real scale = value.is_number() ? value.get<Real>() : Real(0);
      if (!(scale > 0 && scale <= kMaxCoordinate)) {
        fail_shape(body, ".scale: must be a number > 0 and at most 1e9");
      }
      shape.scale = scale;
    } else if (name == "two_sided" && !shape.is_hull) {
      if (!value.is_boolean()) fail_shape(body, ".two_sided: must be a boolean");
      shape.two_sided = value.get<bool>();
    } else {
      fail_shape(body, ": has an unknown field \"" + name +
                           "\"; known fields of a shape in a file are " +
                           (shape.is_hull ? "file, scale, type" : "file, scale, two_sided, type"));
    }
  }
  return shape;
}

/// Reads each file once; bodies share meshes.
class ShapeReader {
 public:
  explicit ShapeReader(std::filesystem::path folder) : folder_(std::move(folder)) {}

  Shape read(const FileShape& shape, bool is_movable) {
    if (shape.is_hull) {
      const Hull hull(scaled_def(shape).vertices);
      return is_movable ? centred(hull) : hull;
    }
    TriangleMesh& mesh = meshes_[{shape.file, shape.scale, shape.two_sided}];
    if (mesh.data() == nullptr) mesh = TriangleMesh(scaled_def(shape));
    return mesh;
  }

 private:
  TriangleMeshDef scaled_def(const FileShape& shape) {
    TriangleMeshDef& file = files_[shape.file];
    if (file.triangles.empty()) file = read_mesh_file(to_text(folder_ / to_path(shape.file)));
    TriangleMeshDef def = file;
    for (Vec3& vertex : def.vertices) vertex *= shape.scale;
    def.two_sided = shape.two_sided;
    return def;
  }

  std::filesystem::path folder_;
  std::map<std::string, TriangleMeshDef> files_;
  std::map<std::tuple<std::string, Real, bool>, TriangleMesh> meshes_;
};

/// Replaces the shapes in files by balls.
std::vector<FileShape> take_file_shapes(Json* json) {
  std::vector<FileShape> taken;
  if (!json->is_object() || !json->contains("bodies")) return taken;
  Json& bodies = (*json)["bodies"];
  if (!bodies.is_array()) return taken;
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    Json& body = bodies[i];
    if (!body.is_object() || !body.contains("shape")) continue;
    Json& shape = body["shape"];
    if (!shape.is_object() || !shape.contains("file")) continue;
    taken.push_back(file_shape(i, shape));
    shape = {{"type", "sphere"}, {"radius", 1}};
  }
  return taken;
}

Scene scene_with_files(const std::string& path) {
  Json json = parse_json(read_file(path));
  const std::vector<FileShape> shapes = take_file_shapes(&json);
  Scene scene = scene_from_value(json);
  if (shapes.empty()) return scene;
  ShapeReader reader(to_path(path).parent_path());
  for (const FileShape& shape : shapes) {
    BodyDef& body = scene.bodies[shape.body];
    try {
      body.shape = reader.read(shape, body.mass > 0);
    } catch (const InvalidArgument& error) {  // by the constructor of the shape
      fail_shape(shape.body, ".file: " + shape.file + ": " + error.what());
    }
  }
  validate(scene);
  return scene;
}

}  // namespace

Scene load_scene_file(const std::string& path) {
  if (is_mesh_file(path)) {
    Scene scene;
    scene.name = to_text(to_path(path).stem());
    BodyDef& body = scene.bodies.emplace_back();
    body.mass = 0;
    try {
      body.shape = TriangleMesh(read_mesh_file(path));
    } catch (const InvalidArgument& error) {
      throw FileError(path + ": " + error.what());
    }
    return scene;
  }
  try {
    return scene_with_files(path);
  } catch (const InvalidScene& error) {
    throw InvalidScene(path + ": " + error.what());
  }
}

}  // namespace tool
}  // namespace JFPX_ABI
}  // namespace jfpx
