/// Initial position of the camera.
#include "src/viewer/framing.hpp"

#include "src/collide/mesh_queries.hpp"
#include "src/viewer/scene_painter.hpp"
#include "src/viewer/shapes.hpp"
#include "src/viewer/surface_mesh.hpp"

#include <algorithm>
#include <cmath>
#include <variant>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace view {
namespace {

constexpr Real kMargin = Real(1.1);

/// Distance of the eye from the focus at which nearly all movable bodies are in the picture.
Real distance_for(const Camera& camera, const Bounds& bounds, const Scene& scene,
                  const RunState& run_state, Real aspect) {
  const View view = camera.view(bounds.centre, bounds.radius);
  const Real tall = std::tan(camera.fov_y / 2), wide = tall * aspect;
  std::vector<Real> needed;
  for (std::size_t i = 0; i < scene.bodies.size(); ++i) {
    const BodyDef& body = scene.bodies[i];
    const Vec3 p = run_state.states[i].position - bounds.centre;
    if (body.mass == 0 || length(p) > bounds.radius) continue;
    const Real size = size_of(body.shape);
    needed.push_back(std::max((std::fabs(dot(p, view.right)) + size) / wide,
                              (std::fabs(dot(p, view.up)) + size) / tall) -
                     dot(p, view.forward));
  }
  if (needed.empty()) return bounds.radius / std::sin(camera.fov_y / 2);
  return std::max(*std::max_element(needed.begin(), needed.end()), bounds.radius / 2) * kMargin;
}

/// Share of the movable bodies that no mesh hides from the eye, from a sample of them. The rays
/// start at the bodies, because only they are in front of one-sided meshes for certain.
Real visible_share(const Vec3& eye, const Bounds& bounds, const Scene& scene,
                   const RunState& run_state, const std::vector<std::size_t>& meshes) {
  constexpr std::size_t kRays = 64;
  const std::size_t stride = std::max(scene.bodies.size() / kRays, std::size_t{1});
  std::size_t sampled = 0, visible = 0;
  for (std::size_t i = 0; i < scene.bodies.size(); i += stride) {
    const Vec3& from = run_state.states[i].position;
    if (!(scene.bodies[i].mass > 0) || !(length(from - bounds.centre) <= bounds.radius)) continue;
    const bool hidden = std::ranges::any_of(meshes, [&](std::size_t k) {
      const TriangleMesh mesh = mesh_of(scene.bodies[k].shape);
      return jfpx::detail::enter(from, normalized(eye - from), mesh, pose(run_state.states[k]),
                                 length(eye - from))
          .hit;
    });
    ++sampled;
    visible += hidden ? 0 : 1;
  }
  return sampled == 0 ? 1 : static_cast<Real>(visible) / static_cast<Real>(sampled);
}

}  // namespace

Camera initial_camera(const ViewOptions& options, const Scene& scene, const RunState& run_state) {
  Camera camera;
  if (options.eye) {
    camera.look_at(*options.eye, *options.target);
    return camera;
  }
  Bounds bounds = bounds_of(scene, run_state.states);
  const Real largest = ScenePainter(scene).large_size() * 60;
  const Vec3& half = bounds.half_extents;
  const bool tall = half.y > 4 * std::max(half.x, half.z);
  if (tall && bounds.radius > largest) {
    bounds.centre.y -= (bounds.radius - largest) * Real(0.9);
    bounds.radius = largest;
  }
  const Real aspect =
      static_cast<Real>(options.size.width) / static_cast<Real>(options.size.height);
  const auto from_height = [&](Real height) {
    Camera high;
    const Vec3 from = normalized(Vec3{Real(0.55), height, Real(0.95)});
    high.look_at(bounds.centre + from, bounds.centre);
    high.look_at(bounds.centre + from * distance_for(high, bounds, scene, run_state, aspect),
                 bounds.centre);
    return high;
  };
  camera = from_height(Real(0.36));
  std::vector<std::size_t> meshes;
  for (std::size_t i = 0; i < scene.bodies.size(); ++i) {
    if (is_mesh(scene.bodies[i].shape)) meshes.push_back(i);
  }
  if (meshes.empty()) return camera;
  const auto share = [&](const Camera& from) {
    return visible_share(from.eye(), bounds, scene, run_state, meshes);
  };
  Real most = share(camera);
  for (const Real height : {Real(0.6), Real(1), Real(1.8), Real(4)}) {
    if (most >= Real(0.8)) break;
    const Camera high = from_height(height);
    const Real visible = share(high);
    if (visible > most) {
      most = visible;
      camera = high;
    }
  }
  return camera;
}

}  // namespace view
}  // namespace JFPX_ABI
}  // namespace jfpx
