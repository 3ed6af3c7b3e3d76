/// Triangulation of hulls, round solids and heightfields.
#include "src/viewer/surface_mesh.hpp"

#include "src/collide/hull/triangles.hpp"
#include "src/collide/shapes.hpp"

#include <array>
#include <cmath>
#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <type_traits>
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
  TriangleMeshDef def{
      {hull.vertices().begin(), hull.vertices().end()}, jfpx::detail::triangles_of(hull), false};
  return mesh = TriangleMesh(std::move(def));
}

TriangleMesh mesh_of(const jfpx::detail::Frustum& frustum) {
  constexpr std::uint32_t kSides = 32;
  static std::mutex mutex;
  static std::map<std::array<Real, 4>, TriangleMesh> meshes;
  const std::lock_guard lock(mutex);
  TriangleMesh& mesh =
      meshes[{frustum.lower, frustum.upper, frustum.lower_radius, frustum.upper_radius}];
  if (mesh.data() != nullptr) return mesh;
  TriangleMeshDef def{{{0, frustum.lower, 0}, {0, frustum.upper, 0}}, {}, false};
  for (std::uint32_t i = 0; i < kSides; ++i) {
    const Real angle = 2 * kPi * static_cast<Real>(i) / kSides;
    const Vec3 radial{std::cos(angle), 0, -std::sin(angle)};
    def.vertices.push_back(frustum.rim_point(false, radial));
    def.vertices.push_back(frustum.rim_point(true, radial));
  }
  for (std::uint32_t i = 0; i < kSides; ++i) {
    const std::uint32_t a = 2 + 2 * i, b = 2 + 2 * ((i + 1) % kSides);
    def.triangles.insert(def.triangles.end(), {{0, b, a}, {a, b, b + 1}});
    if (frustum.cap_count() == 2) {
      def.triangles.insert(def.triangles.end(), {{1, a + 1, b + 1}, {a, b + 1, a + 1}});
    }
  }
  return mesh = TriangleMesh(std::move(def));
}

TriangleMesh mesh_of(const Heightfield& heightfield) {
  struct Entry {
    std::weak_ptr<const jfpx::detail::HeightfieldData> data;
    TriangleMesh mesh;
  };
  static std::mutex mutex;
  static std::unordered_map<const void*, Entry> meshes;
  const std::lock_guard lock(mutex);
  // Precedes the search, because the address of a heightfield can be that of an earlier one.
  std::erase_if(meshes, [](const auto& entry) { return entry.second.data.expired(); });
  Entry& entry = meshes[heightfield.data().get()];
  if (entry.mesh.data() == nullptr) entry = {heightfield.data(), to_triangle_mesh(heightfield)};
  return entry.mesh;
}

TriangleMesh mesh_of(const Shape& shape) {
  if (const auto* mesh = std::get_if<TriangleMesh>(&shape)) return *mesh;
  const auto* heightfield = std::get_if<Heightfield>(&shape);
  return heightfield != nullptr ? mesh_of(*heightfield) : TriangleMesh();
}

bool is_mesh(const Shape& shape) {
  return std::visit([](const auto& s) { return jfpx::detail::kIsMesh<std::decay_t<decltype(s)>>; },
                    shape);
}

}  // namespace view
}  // namespace JFPX_ABI
}  // namespace jfpx
