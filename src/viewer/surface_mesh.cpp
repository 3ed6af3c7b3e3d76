/// Triangulation of hulls.
#include "src/viewer/hull_mesh.hpp"

#include <cstdint>
#include <mutex>
#include <unordered_map>
#include <utility>

namespace jfpx {
inline namespace JFPX_ABI {
namespace view {

TriangleMesh mesh_of(const Hull& hull) {
  static std::mutex mutex;
  static std::unordered_map<std::uint64_t, TriangleMesh> meshes;  // by HullView::serial
  const std::lock_guard lock(mutex);
  TriangleMesh& mesh = meshes[hull.data().view.serial];
  if (mesh.data() != nullptr) return mesh;
  TriangleMeshDef def{{hull.vertices().begin(), hull.vertices().end()}, {}, false};
  for (const HullFace& face : hull.faces()) {
    const auto corners = hull.corners(face);
    for (std::size_t k = 2; k < corners.size(); ++k) {
      def.triangles.push_back({corners[0], corners[k - 1], corners[k]});
    }
  }
  return mesh = TriangleMesh(std::move(def));
}

}  // namespace view
}  // namespace JFPX_ABI
}  // namespace jfpx
