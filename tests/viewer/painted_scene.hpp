/// Scenes at rest for tests of pictures.
#pragma once

#include "src/viewer/scene_painter.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace test {

inline void add(Scene* scene, const Shape& shape, const Vec3& position, Real mass) {
  BodyDef& body = scene->bodies.emplace_back();
  body.shape = shape;
  body.position = position;
  body.mass = mass;
}

/// The state of a scene before the first step, with all bodies awake.
inline view::RunState run_state_of(const Scene& scene) {
  view::RunState run_state;
  for (const BodyDef& body : scene.bodies) {
    run_state.states.push_back({body.position, body.orientation, {}, {}});
  }
  run_state.awake.assign(scene.bodies.size(), 1);
  return run_state;
}

inline view::Drawing draw(const Scene& scene, const view::RunState& run_state) {
  view::Drawing drawing({});
  view::ScenePainter(scene).draw(run_state, run_state, 1, view::Colouring::bodies, &drawing);
  return drawing;
}

}  // namespace test
}  // namespace JFPX_ABI
}  // namespace jfpx
