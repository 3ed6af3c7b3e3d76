/// Lines of a World for the renderer of a program: shapes, joints, contacts.
#pragma once

#include <jfpx/world.hpp>

#include <cstdint>
#include <optional>
#include <string_view>

namespace jfpx {
inline namespace JFPX_ABI {

/// Color of a line: 0xRRGGBB.
using DebugColor = std::uint32_t;

/// Receives what debug_draw() draws. Coordinates are those of the world [m].
class JFPX_API DebugDraw {
 public:
  virtual ~DebugDraw() = default;
  virtual void line(const Vec3& from, const Vec3& to, DebugColor color) = 0;
  /// A triangle of a mesh or a heightfield, counterclockwise as seen from its front. By default,
  /// three lines; neighboring triangles share edges, which are then drawn twice.
  virtual void triangle(const Vec3& a, const Vec3& b, const Vec3& c, DebugColor color);
  /// A label; by default, nothing.
  virtual void text(const Vec3& at, std::string_view text, DebugColor color);
};

/// What debug_draw() draws.
struct DebugDrawOptions {
  bool shapes = true;           ///< surfaces of bodies
  bool joints = true;           ///< lines from the bodies to the anchors, and the joint axes of a
  bool contacts = false;        ///< points and normals of World::contacts()
  bool contact_forces = false;  ///< World::contact_forces()
  bool velocities = false;      ///< from the centres of mass, as long as the motion in 0.1 s
  bool axes = false;            ///< of bodies: x red, y green, z blue
  bool labels = false;          ///< the index of each body, by DebugDraw::text()
  /// Only bodies that overlap this box, their joints, and contacts in it; triangles whose bounds
  /// overlap it. All bodies if absent.
  std::optional<Aabb> region = {};
  /// Which bodies are drawn; empty: all.
  BodyFilter filter = {};

  Real axis_length = Real(0.25);     ///< [m], of joint axes, body axes and normals, > 0
  Real force_length = Real(0.01);    ///< [m/N], of contact forces
  Real wall_size = 20;               ///< [m], > 0: side of the square that is drawn of a wall
  std::uint32_t circle_points = 24;  ///< of a circle of a round solid, 4 to 1024

  DebugColor awake = 0xe8a33d, asleep = 0x8c8f94;  ///< of movable bodies
  DebugColor immovable = 0x6f9f6f, kinematic = 0x4a90d9, sensor = 0xc678dd;
  DebugColor joint = 0x3fc1c0, contact = 0xe05252, force = 0xf2d43d, velocity = 0x9ad14b;
  DebugColor label = 0xffffff;
};

/// Draws a world, body by body in the order of bodies(), then joints and contacts. Triangle meshes
/// and heightfields are drawn as triangles, all other shapes as lines on their surfaces. A world on
/// a GPU copies what is drawn to the host.
/// @param draw not null; its functions are called in this thread, and must not change the world
/// @throws InvalidArgument for an option out of its range, or a region that is empty or beyond
///   kMaxCoordinate; the exceptions of World::states(), contacts() and of *draw
JFPX_API void debug_draw(const World& world, DebugDraw* draw, const DebugDrawOptions& options = {});

}  // namespace JFPX_ABI
}  // namespace jfpx
