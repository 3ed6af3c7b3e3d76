/// Replaces assimp.cpp in builds without assimp.
#include <jfpx/error.hpp>

#include "src/tool/mesh_readers.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace tool {

TriangleMeshDef read_by_assimp(const std::string& path) {
  throw FileError(path +
                  ": this program is built without assimp, which reads OBJ, STL and glTF; install "
                  "assimp (libassimp-dev) and configure with -DJFPX_ASSIMP=ON");
}

}  // namespace tool
}  // namespace JFPX_ABI
}  // namespace jfpx
