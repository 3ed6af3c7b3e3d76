/// Scene files whose shapes may be in files of meshes.
#pragma once

#include <jfpx/scene.hpp>

#include <string>

namespace jfpx {
inline namespace JFPX_ABI {
namespace tool {

/// Reads a scene file as load_scene(). The shape of a body may also be
///   {"type": "triangle_mesh", "file": PATH, "scale": 1, "two_sided": false} or
///   {"type": "hull", "file": PATH, "scale": 1},
/// with a path relative to the folder of the scene file. `scale` and `two_sided` are optional; the
/// hull is that of all vertices of the file, with its centre of mass at the origin if the body is
/// movable. A file of a mesh instead of a scene is a scene with this mesh.
/// @throws FileError if a file can't be read; InvalidScene as load_scene()
Scene load_scene_file(const std::string& path);

}  // namespace tool
}  // namespace JFPX_ABI
}  // namespace jfpx
