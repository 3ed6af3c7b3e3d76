/// Initial position of the camera.
#include "src/viewer/framing.hpp"

#include "src/viewer/scene_painter.hpp"
#include "src/viewer/shapes.hpp"

#include <algorithm>
#include <cmath>

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
  const Vec3 from = normalized(Vec3{Real(0.55), Real(0.36), Real(0.95)});
  camera.look_at(bounds.centre + from, bounds.centre);
  camera.look_at(bounds.centre + from * distance_for(camera, bounds, scene, run_state, aspect),
                 bounds.centre);
  return camera;
}

}  // namespace view
}  // namespace JFPX_ABI
}  // namespace jfpx
