/// The lines of debug_draw() as arrays.
#include <jfpx/debug_draw.hpp>

#include "python/src/world.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace python {

namespace {

struct Line {
  Vec3 from, to;
};
struct Color {
  std::uint8_t red, green, blue;
};

/// Keeps the lines that are drawn.
struct Lines : DebugDraw {
  std::vector<Line> lines;
  std::vector<Color> colors;

  void line(const Vec3& from, const Vec3& to, DebugColor color) override {
    lines.push_back({from, to});
    colors.push_back({static_cast<std::uint8_t>(color >> 16 & 255),
                      static_cast<std::uint8_t>(color >> 8 & 255),
                      static_cast<std::uint8_t>(color & 255)});
  }
};

/// @param shown shapes, joints, contacts, contact forces, velocities, axes
/// @param lengths axis_length, force_length, wall_size
/// @param region the lower and the upper corner
/// @returns arrays (L, 6) and (L, 3)
nb::tuple debug_lines(const PythonWorld& self, const std::array<bool, 6>& shown,
                      const Triple& lengths, std::uint32_t circle_points,
                      const std::optional<std::pair<Triple, Triple>>& region,
                      const nb::object& filter) {
  DebugDrawOptions options;
  options.shapes = shown[0];
  options.joints = shown[1];
  options.contacts = shown[2];
  options.contact_forces = shown[3];
  options.velocities = shown[4];
  options.axes = shown[5];
  options.axis_length = static_cast<Real>(lengths[0]);
  options.force_length = static_cast<Real>(lengths[1]);
  options.wall_size = static_cast<Real>(lengths[2]);
  options.circle_points = circle_points;
  if (region) options.region = Aabb{to_vec3(region->first), to_vec3(region->second)};
  options.filter = to_filter(filter);
  Lines drawn;
  debug_draw(self.get(), &drawn, options);
  return nb::make_tuple(own<Real>(std::move(drawn.lines)),
                        own<std::uint8_t>(std::move(drawn.colors)));
}

}  // namespace

void bind_drawing(nb::class_<PythonWorld>& world) {
  world.def("debug_lines", &debug_lines, nb::arg("shown"), nb::arg("lengths"),
            nb::arg("circle_points"), nb::arg("region").none(), nb::arg("filter").none());
}

}  // namespace python
}  // namespace JFPX_ABI
}  // namespace jfpx
