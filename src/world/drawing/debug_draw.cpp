/// Lines of the surfaces of shapes, of joints and contacts; see the header.
#include <jfpx/debug_draw.hpp>

#include "src/scene/scene_validate.hpp"
#include "src/world/queries/query_arguments.hpp"

#include <algorithm>
#include <cmath>
#include <span>
#include <string>
#include <type_traits>
#include <utility>
#include <variant>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace {

constexpr Real kVelocityTime = Real(0.1);  ///< [s]
constexpr Vec3 kX{1, 0, 0}, kY{0, 1, 0}, kZ{0, 0, 1};

void validate(const DebugDrawOptions& options) {
  const auto require_positive = [](const char* name, Real x) {
    require_in_query(x > 0 && is_finite(x), name, to_text(x), "finite and > 0");
  };
  require_positive("axis_length", options.axis_length);
  require_positive("wall_size", options.wall_size);
  require_in_query(is_finite(options.force_length), "force_length", to_text(options.force_length),
                   "finite");
  require_in_query(options.circle_points >= 4 && options.circle_points <= 1024, "circle_points",
                   std::to_string(options.circle_points), "in [4, 1024]");
}

bool contains(const Aabb& box, const Vec3& p) { return overlap(box, {p, p}); }

/// Draws in the axes of a body or a part.
class Painter {
 public:
  Painter(DebugDraw* draw, const DebugDrawOptions& options, DebugColor color, const Vec3& position,
          const Quat& orientation)
      : draw_(draw),
        options_(options),
        color_(color),
        position_(position),
        orientation_(orientation) {}

  void paint(const Sphere& s) const {
    circle({}, kX, kY, s.radius);
    circle({}, kY, kZ, s.radius);
    circle({}, kZ, kX, s.radius);
  }
  void paint(const Box& box) const {
    const Vec3& h = box.half_extents;
    const auto corner = [&h](unsigned i) {
      return Vec3{(i & 1) != 0 ? h.x : -h.x, (i & 2) != 0 ? h.y : -h.y, (i & 4) != 0 ? h.z : -h.z};
    };
    for (unsigned i = 0; i < 8; ++i) {
      for (const unsigned bit : {1u, 2u, 4u}) {
        if ((i & bit) == 0) line(corner(i), corner(i | bit));
      }
    }
  }
  void paint(const Capsule& c) const {
    for (const Real side : {Real(-1), Real(1)}) {
      const Vec3 centre = kY * (side * c.half_height);
      circle(centre, kX, kZ, c.radius);
      arc(centre, kX, kY * side, c.radius, kPi);
      arc(centre, kZ, kY * side, c.radius, kPi);
    }
    for_sides([&](const Vec3& side) {
      const Vec3 at = side * c.radius, half = kY * c.half_height;
      line(at - half, at + half);
    });
  }
  void paint(const Cylinder& c) const {
    const Vec3 half = kY * c.half_height;
    circle(half, kX, kZ, c.radius);
    circle(-half, kX, kZ, c.radius);
    for_sides([&](const Vec3& side) { line(side * c.radius - half, side * c.radius + half); });
  }
  void paint(const Cone& c) const {
    const Vec3 base = kY * (-c.half_height / 2), apex = kY * (Real(1.5) * c.half_height);
    circle(base, kX, kZ, c.radius);
    for_sides([&](const Vec3& side) { line(base + side * c.radius, apex); });
  }
  void paint(const Hull& hull) const {
    for (const HullEdge& edge : hull.edges()) {
      line(hull.vertices()[edge.a], hull.vertices()[edge.b]);
    }
  }
  void paint(const Compound& compound) const {
    for (const CompoundPart& part : compound.parts) {
      const Painter painter(draw_, options_, color_, world(part.position),
                            orientation_ * part.orientation);
      std::visit([&painter](const auto& shape) { painter.paint(shape); }, part.shape);
    }
  }
  void paint(const HalfSpace& wall) const { square(wall.normal, wall.offset); }
  void paint(const Plane& wall) const { square(wall.normal, wall.offset); }
  void paint(const TriangleMesh& mesh) const {
    const std::span<const Vec3> vertices = mesh.vertices();
    for (const Triangle& t : mesh.triangles()) {
      triangle(vertices[t[0]], vertices[t[1]], vertices[t[2]]);
    }
  }
  void paint(const Heightfield& field) const {
    const HeightfieldDef& def = field.def();
    if (def.columns < 2 || def.rows < 2) return;
    std::vector<std::uint8_t> is_hole(def.holes.empty() ? 0 : def.heights.size(), 0);
    for (const std::uint32_t cell : def.holes) is_hole[cell] = 1;
    const auto [first_row, last_row] = cells_near(def.rows, def.spacing_z, 2);
    const auto [first_column, last_column] = cells_near(def.columns, def.spacing_x, 0);
    for (std::uint32_t row = first_row; row < last_row; ++row) {
      for (std::uint32_t column = first_column; column < last_column; ++column) {
        if (!is_hole.empty() && is_hole[row * std::size_t{def.columns} + column] != 0) continue;
        const Vec3 a = field.vertex(row, column), b = field.vertex(row + 1, column);
        const Vec3 c = field.vertex(row, column + 1), d = field.vertex(row + 1, column + 1);
        triangle(a, b, c);
        triangle(c, b, d);
      }
    }
  }
  void axes() const {
    for (const auto& [axis, color] : {std::pair(kX, 0xff0000u), {kY, 0x00ff00u}, {kZ, 0x0000ffu}}) {
      draw_->line(position_, world(axis * options_.axis_length), color);
    }
  }

 private:
  Vec3 world(const Vec3& local) const { return position_ + rotate(orientation_, local); }
  void line(const Vec3& a, const Vec3& b) const { draw_->line(world(a), world(b), color_); }
  void triangle(const Vec3& a, const Vec3& b, const Vec3& c) const {
    const Vec3 at[3] = {world(a), world(b), world(c)};
    if (options_.region) {
      Aabb box;
      for (const Vec3& corner : at) box = merged(box, {corner, corner});
      if (!overlap(box, *options_.region)) return;
    }
    draw_->triangle(at[0], at[1], at[2], color_);
  }
  /// Part of a circle that starts at u and turns towards v. @param angle [rad]
  void arc(const Vec3& centre, const Vec3& u, const Vec3& v, Real radius, Real angle) const {
    const auto count = static_cast<std::uint32_t>(
        std::max(Real(2), static_cast<Real>(options_.circle_points) * angle / (2 * kPi)));
    Vec3 before = centre + u * radius;
    for (std::uint32_t k = 1; k <= count; ++k) {
      const Real turned = angle * static_cast<Real>(k) / static_cast<Real>(count);
      const Vec3 next = centre + (u * std::cos(turned) + v * std::sin(turned)) * radius;
      line(before, next);
      before = next;
    }
  }
  void circle(const Vec3& centre, const Vec3& u, const Vec3& v, Real radius) const {
    arc(centre, u, v, radius, 2 * kPi);
  }
  /// Calls f(direction) for directions perpendicular to the axis of a round solid.
  template <class F>
  static void for_sides(const F& f) {
    for (const Vec3& side : {kX, kZ, -kX, -kZ}) f(side);
  }
  /// A grid on a wall, about the point that is closest to the middle of the region, or to the
  /// origin. Walls ignore the pose of their body.
  void square(const Vec3& normal, Real offset) const {
    const Vec3 middle =
        options_.region ? (options_.region->lower + options_.region->upper) * Real(0.5) : Vec3{};
    const Vec3 at = middle - normal * (dot(normal, middle) - offset);
    const Quat axes = axes_along(normal);
    const Vec3 u = rotate(axes, kY), v = rotate(axes, kZ);
    constexpr int kLines = 11;
    const Real half = options_.wall_size / 2;
    for (int k = 0; k < kLines; ++k) {
      const Real t = options_.wall_size * static_cast<Real>(k) / (kLines - 1) - half;
      draw_->line(at + u * t - v * half, at + u * t + v * half, color_);
      draw_->line(at + v * t - u * half, at + v * t + u * half, color_);
    }
    draw_->line(at, at + normal * options_.axis_length, color_);
  }
  /// The cells of a heightfield along an axis of the body that may overlap the region.
  std::pair<std::uint32_t, std::uint32_t> cells_near(std::uint32_t vertices, Real spacing,
                                                     int axis) const {
    const std::uint32_t cells = vertices - 1;
    if (!options_.region) return {0, cells};
    const Aabb& box = *options_.region;
    const Vec3 middle =
        rotate(conjugate(orientation_), (box.lower + box.upper) * Real(0.5) - position_);
    const Real reach = length(box.upper - box.lower) * Real(0.5);
    const Real half = static_cast<Real>(cells) * Real(0.5);
    const auto cell_at = [&](Real x, Real more) {
      const Real cell = std::floor(x / spacing + half) + more;
      return static_cast<std::uint32_t>(std::clamp(cell, Real(0), static_cast<Real>(cells)));
    };
    return {cell_at(middle[axis] - reach, -1), cell_at(middle[axis] + reach, 2)};
  }

  DebugDraw* draw_;
  const DebugDrawOptions& options_;
  DebugColor color_;
  Vec3 position_;
  Quat orientation_;
};

DebugColor color_of(const World& world, BodyId id, const DebugDrawOptions& options) {
  if (world.sensor(id)) return options.sensor;
  const bool is_awake = world.awake(id);  // of a body of mass 0: kinematic and in motion
  if (world.mass(id) > 0) return is_awake ? options.awake : options.asleep;
  return is_awake || world.definition(id).kinematic ? options.kinematic : options.immovable;
}

std::vector<BodyId> drawn_bodies(const World& world, const DebugDrawOptions& options) {
  std::vector<BodyId> bodies;
  if (options.region) {
    const Aabb& box = *options.region;
    const Box solid{(box.upper - box.lower) * Real(0.5)};
    try {
      bodies = world.overlapping(solid, (box.lower + box.upper) * Real(0.5));
    } catch (const InvalidArgument& error) {
      throw InvalidArgument(std::string("region: ") + error.what());
    }
  } else {
    bodies.assign(world.bodies().begin(), world.bodies().end());
  }
  if (options.filter) std::erase_if(bodies, [&](BodyId id) { return !options.filter(id); });
  return bodies;
}

void draw_joint(const World& world, JointId id, DebugDraw* draw, const DebugDrawOptions& options) {
  const JointState state = world.joint_state(id);
  draw->line(state.point_a, state.point_b, options.joint);
  std::visit(
      [&](const auto& joint) {
        const BodyState a = world.state(joint.a);
        draw->line(a.position, state.point_a, options.joint);
        if (joint.b) draw->line(world.state(*joint.b).position, state.point_b, options.joint);
        if constexpr (!std::is_same_v<std::decay_t<decltype(joint)>, DistanceJoint>) {
          const Vec3 x = rotate(a.orientation * joint.axes_a, kX);
          draw->line(state.point_a, state.point_a + x * options.axis_length, options.joint);
        }
      },
      world.joint(id));
}

}  // namespace

void DebugDraw::triangle(const Vec3& a, const Vec3& b, const Vec3& c, DebugColor color) {
  line(a, b, color);
  line(b, c, color);
  line(c, a, color);
}
void DebugDraw::text(const Vec3&, std::string_view, DebugColor) {}

void debug_draw(const World& world, DebugDraw* draw, const DebugDrawOptions& options) {
  validate(options);
  const std::vector<BodyId> bodies = drawn_bodies(world, options);
  for (const BodyId id : bodies) {
    const BodyState state = world.state(id);
    const Painter painter(draw, options, color_of(world, id, options), state.position,
                          state.orientation);
    if (options.shapes) {
      std::visit([&painter](const auto& shape) { painter.paint(shape); }, world.shape(id));
    }
    if (options.axes) painter.axes();
    if (options.velocities && !(state.velocity == Vec3{})) {
      draw->line(state.position, state.position + state.velocity * kVelocityTime, options.velocity);
    }
    if (options.labels) draw->text(state.position, std::to_string(id.index), options.label);
  }
  const auto is_drawn = [&](BodyId id) {
    return std::ranges::binary_search(bodies, id.index, {}, &BodyId::index);
  };
  if (options.joints) {
    for (const JointId id : world.joints()) {
      const bool any = std::visit(
          [&](const auto& joint) { return is_drawn(joint.a) || (joint.b && is_drawn(*joint.b)); },
          world.joint(id));
      if (any) draw_joint(world, id, draw, options);
    }
  }
  const auto is_in_region = [&](BodyId a, BodyId b, const Vec3& point) {
    return (is_drawn(a) || is_drawn(b)) && (!options.region || contains(*options.region, point));
  };
  if (options.contacts) {
    for (const Contact& c : world.contacts()) {
      if (!is_in_region(c.a, c.b, c.point)) continue;
      draw->line(c.point, c.point + c.normal * options.axis_length, options.contact);
    }
  }
  if (options.contact_forces) {
    for (const ContactForce& c : world.contact_forces()) {
      const Vec3 point = world.state(c.a).position + c.arm_a;
      if (!is_in_region(c.a, c.b, point)) continue;
      draw->line(point, point + c.force * options.force_length, options.force);
    }
  }
}

}  // namespace JFPX_ABI
}  // namespace jfpx
