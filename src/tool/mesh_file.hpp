/// Files of triangle meshes: OBJ, STL, PLY and glTF.
#pragma once

#include <jfpx/triangle_mesh.hpp>

#include <string>

namespace jfpx {
inline namespace JFPX_ABI {
namespace tool {

/// Whether the name of a file ends with .obj, .stl, .ply, .gltf or .glb, in any case.
bool is_mesh_file(const std::string& path);

/// The triangles of all objects of a file, in its axes and its unit of length. Polygons are divided
/// into triangles; points and lines are left out.
/// @throws FileError if the file can't be read, is of another type, or has no triangles, or if the
///   program is built without assimp, which all formats but PLY need
TriangleMeshDef read_mesh_file(const std::string& path);

}  // namespace tool
}  // namespace JFPX_ABI
}  // namespace jfpx
