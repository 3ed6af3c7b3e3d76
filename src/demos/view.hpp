/// Renderer-independent picture of a demo: solids, lines, a camera and text.
#pragma once

#include <jfpx/shape.hpp>

#include <string>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace demos {

/// An RGB colour.
struct Colour {
  float red = 0, green = 0, blue = 0;  ///< [-], in [0, 1]
};

/// A sphere or box. A shadow is an item that `scale` flattens onto the ground.
struct Item {
  Shape shape = {};
  Vec3 position = {};  ///< [m]
  Quat orientation = {};
  Colour colour = {};
  Vec3 scale{1, 1, 1};  ///< [-], along the world axes, applied after the rotation
};

/// A line segment.
struct Line {
  Vec3 from, to;  ///< [m]
  Colour colour = {};
};

/// A perspective camera.
struct Camera {
  Vec3 eye{0, 10, 50};    ///< [m]
  Vec3 target{0, 10, 0};  ///< [m]
  Vec3 up{0, 1, 0};
  Real field_of_view = 45;  ///< [degrees], vertical
};

/// A picture. The renderer must choose near and far planes that contain the items (erratum E43).
struct View {
  std::vector<Item> items;
  std::vector<Line> lines;
  Camera camera;
  std::vector<std::string> text;  ///< lines of a head-up display
};

}  // namespace demos
}  // namespace JFPX_ABI
}  // namespace jfpx
