/// A scene with known contacts and positions in the picture.
#pragma once

#include "src/viewer/options.hpp"

#include <string>

namespace jfpx {
inline namespace JFPX_ABI {
namespace test {

inline constexpr view::Size kRowSize{800, 640};
/// A fast quality for tests of positions.
inline constexpr view::Quality kSketch{.samples = 1, .shadow_size = 0, .occlusion_samples = 0};

/// Four balls in a row that touch their neighbours, to the right of the panel.
/// @param path of the scene file, which is written
inline view::ViewOptions row_of_balls(const std::string& path) {
  Scene scene;
  for (int i = 0; i < 4; ++i) {
    BodyDef ball;
    ball.shape = Sphere{Real(0.5)};
    ball.position = {Real(i) * Real(0.999), 0, 0};
    ball.mass = 1;
    scene.bodies.push_back(ball);
  }
  save_scene(scene, path);
  view::ViewOptions options;
  options.run.scene = path;
  options.size = kRowSize;
  options.quality = kSketch;
  options.eye = {-1, 0, 12};
  options.target = {-1, 0, 0};
  return options;
}

}  // namespace test
}  // namespace JFPX_ABI
}  // namespace jfpx
