/// What a demo shows: solid things, lines, a camera and text, for whoever draws them.
#pragma once

#include <jfpx/shape.hpp>

#include <string>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace demos {

struct Colour {
  float red = 0, green = 0, blue = 0;  ///< [-], in [0, 1]
};

/// A sphere or box. A shadow is its body squeezed onto the ground by `scale`.
struct Item {
  Shape shape = {};
  Vec3 position = {};  ///< [m]
  Quat orientation = {};
  Colour colour = {};
  Vec3 scale{1, 1, 1};  ///< [-], of the turned shape, along the axes of the world
};

struct Line {
  Vec3 from, to;  ///< [m]
  Colour colour = {};
};

struct Camera {
  Vec3 eye{0, 10, 50};    ///< [m]
  Vec3 target{0, 10, 0};  ///< [m]
  Vec3 up{0, 1, 0};
  Real field_of_view = 45;  ///< [degrees], vertical
};

/// Near and far planes are the drawer's business: they must fit the items (erratum E43).
struct View {
  std::vector<Item> items;
  std::vector<Line> lines;
  Camera camera;
  std::vector<std::string> text;  ///< lines of a head-up display
};

}  // namespace demos
}  // namespace JFPX_ABI
}  // namespace jfpx
