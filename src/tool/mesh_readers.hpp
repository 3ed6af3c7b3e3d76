/// Readers of files of meshes by format.
#pragma once

#include <jfpx/triangle_mesh.hpp>

#include <string>
#include <string_view>

namespace jfpx {
inline namespace JFPX_ABI {
namespace tool {

/// Reads PLY, as text or binary, because assimp crashes on damaged files of this format.
/// @param path for messages
/// @throws FileError if the content is no PLY file, ends too early, or has an index of no vertex
TriangleMeshDef read_ply(const std::string& path, std::string_view content);

/// Reads any other format. @throws FileError
TriangleMeshDef read_by_assimp(const std::string& path);

}  // namespace tool
}  // namespace JFPX_ABI
}  // namespace jfpx
