/// Chooses the reader of a file of a mesh.
#include "src/tool/mesh_file.hpp"

#include <jfpx/error.hpp>

#include "src/base/file.hpp"
#include "src/base/system.hpp"
#include "src/tool/mesh_readers.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <filesystem>
#include <string_view>

namespace jfpx {
inline namespace JFPX_ABI {
namespace tool {
namespace {

/// The end of the name from the last dot, in lower case.
std::string extension_of(const std::string& path) {
  std::string extension = to_text(to_path(path).extension());
  std::ranges::transform(extension, extension.begin(), [](char c) {
    return static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  });
  return extension;
}

}  // namespace

bool is_mesh_file(const std::string& path) {
  constexpr std::array<std::string_view, 5> kExtensions{".obj", ".stl", ".ply", ".gltf", ".glb"};
  return std::ranges::find(kExtensions, extension_of(path)) != kExtensions.end();
}

TriangleMeshDef read_mesh_file(const std::string& path) {
  if (!is_mesh_file(path)) {
    throw FileError(path +
                    ": the name of a file of a mesh ends with .obj, .stl, .ply, .gltf or .glb");
  }
  TriangleMeshDef def =
      extension_of(path) == ".ply" ? read_ply(path, read_file(path)) : read_by_assimp(path);
  if (def.triangles.empty()) throw FileError(path + ": the file has no triangles");
  return def;
}

}  // namespace tool
}  // namespace JFPX_ABI
}  // namespace jfpx
