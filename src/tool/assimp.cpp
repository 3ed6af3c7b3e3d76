/// Reads files of triangle meshes by assimp.
#include <jfpx/error.hpp>

#include "src/tool/mesh_readers.hpp"

#include <assimp/Importer.hpp>
#include <assimp/config.h>
#include <assimp/postprocess.h>
#include <assimp/scene.h>

namespace jfpx {
inline namespace JFPX_ABI {
namespace tool {

TriangleMeshDef read_by_assimp(const std::string& path) {
  Assimp::Importer importer;
  importer.SetPropertyInteger(AI_CONFIG_PP_SBP_REMOVE,
                              aiPrimitiveType_POINT | aiPrimitiveType_LINE);
  // The transforms of the nodes of a file become part of the vertices.
  const aiScene* const scene =
      importer.ReadFile(path, aiProcess_Triangulate | aiProcess_SortByPType |
                                  aiProcess_PreTransformVertices | aiProcess_ValidateDataStructure);
  if (scene == nullptr) throw FileError(path + ": " + importer.GetErrorString());
  TriangleMeshDef def;
  for (unsigned m = 0; m < scene->mNumMeshes; ++m) {
    const aiMesh& mesh = *scene->mMeshes[m];
    const auto first = static_cast<std::uint32_t>(def.vertices.size());
    for (unsigned i = 0; i < mesh.mNumVertices; ++i) {
      const aiVector3D& v = mesh.mVertices[i];
      def.vertices.push_back(
          {static_cast<Real>(v.x), static_cast<Real>(v.y), static_cast<Real>(v.z)});
    }
    for (unsigned i = 0; i < mesh.mNumFaces; ++i) {
      const aiFace& face = mesh.mFaces[i];
      if (face.mNumIndices != 3) continue;
      def.triangles.push_back(
          {first + face.mIndices[0], first + face.mIndices[1], first + face.mIndices[2]});
    }
  }
  return def;
}

}  // namespace tool
}  // namespace JFPX_ABI
}  // namespace jfpx
