/// Drawing and picking of the bodies of a scene.
#include "src/viewer/scene_painter.hpp"

#include "src/scene/compound.hpp"
#include "src/viewer/colours.hpp"
#include "src/viewer/forces.hpp"
#include "src/viewer/mesh_geometry.hpp"
#include "src/viewer/shapes.hpp"

#include <algorithm>
#include <cmath>
#include <utility>
#include <variant>

namespace jfpx {
inline namespace JFPX_ABI {
namespace view {
namespace {

constexpr Paint kConcrete{168, 168, 166, Pattern::wall};
/// Darker than kConcrete, because differences of slope are invisible on a bright surface.
constexpr Paint kStone{114, 118, 120, Pattern::wall};
constexpr Paint kGlass{255, 255, 255, Pattern::glass};
constexpr Real kPlate = Real(0.25);  // thickness of a room's floor relative to the body size
/// Radius around the bodies in which meshes cast shadows, relative to the body size. In a larger
/// one the shadows of bodies would be coarse.
constexpr Real kMeshShadows = 40;
constexpr Real kEndless = kMaxReal / 4;

bool movable(const BodyDef& body) { return body.mass > 0; }

int thin_axis(const Vec3& h) {
  int axis = 0;
  for (int i = 1; i < 3; ++i) axis = h[i] < h[axis] ? i : axis;
  return axis;
}

/// Size of the cells of the ground: the power of ten closest to twice the body size.
Real cell_for(Real body_size) {
  return std::pow(Real(10), std::round(std::log10(std::max(body_size, Real(1e-6)) * 2)));
}

/// Distance of a point from the farthest corner of a box.
Real farthest_distance(const Aabb& box, const Vec3& point) {
  Vec3 farthest;
  for (int i = 0; i < 3; ++i) {
    farthest[i] = std::max(std::fabs(box.lower[i] - point[i]), std::fabs(box.upper[i] - point[i]));
  }
  return length(farthest);
}

}  // namespace

ScenePainter::ScenePainter(Scene scene) : scene_(std::move(scene)), bounds_estimator_(scene_) {
  std::vector<Real> sizes;
  for (const BodyDef& body : scene_.bodies) {
    if (!movable(body)) continue;
    sizes.push_back(size_of(body.shape));
    falls_ = falls_ || body.acceleration.y < 0;
  }
  if (!sizes.empty()) {
    std::sort(sizes.begin(), sizes.end());
    body_size_ = sizes[sizes.size() / 2];
    large_size_ = sizes[sizes.size() * 9 / 10];
  }
  for (std::uint32_t i = 0; i < scene_.bodies.size(); ++i) appearances_.push_back(appearance_of(i));
  find_room();
}

std::optional<ScenePainter::Wall> ScenePainter::wall_of(std::uint32_t body,
                                                        const Bounds& bounds) const {
  const BodyDef& def = scene_.bodies[body];
  const Box* box = std::get_if<Box>(&def.shape);
  if (box == nullptr || movable(def) || def.kinematic || def.orientation != Quat{}) return {};
  // The half diagonal of a side of a cube is 0.8 times the radius of its content.
  if (!(length(box->half_extents) > Real(0.7) * bounds.radius)) return {};
  const int axis = thin_axis(box->half_extents);
  const Vec3 away = bounds.centre - def.position;
  for (int k = 0; k < 3; ++k) {
    const bool beside = std::fabs(away[k]) >= box->half_extents[k];
    if (beside != (k == axis)) return {};
  }
  const bool low = away[axis] > 0;
  const Real half = box->half_extents[axis];
  const bool floor = axis == 1 && low;
  return Wall{body, axis, low, def.position[axis] + (low ? half : -half),
              floor ? std::min(body_size_ * kPlate, 2 * half) : 0};
}

// Large axis-aligned boxes around the movable bodies are the walls of a room. They are drawn as
// glass and clipped to the inside, which is thus visible. The largest box on a side is the wall.
void ScenePainter::find_room() {
  std::vector<BodyState> states;
  for (const BodyDef& body : scene_.bodies) states.push_back({body.position, {}, {}, {}});
  const Bounds bounds = bounds_estimator_.bounds(states);
  const auto size = [this](const Wall& wall) { return size_of(scene_.bodies[wall.body].shape); };
  for (std::uint32_t i = 0; i < scene_.bodies.size(); ++i) {
    const std::optional<Wall> wall = wall_of(i, bounds);
    if (!wall) continue;
    const auto rival = std::find_if(walls_.begin(), walls_.end(), [&](const Wall& other) {
      return other.axis == wall->axis && other.low == wall->low;
    });
    if (rival == walls_.end()) {
      walls_.push_back(*wall);
    } else if (size(*wall) > size(*rival)) {
      *rival = *wall;
    }
  }
  room_ = {{-kEndless, -kEndless, -kEndless}, {kEndless, kEndless, kEndless}};
  for (const Wall& wall : walls_) {
    (wall.low ? room_.lower : room_.upper)[wall.axis] = wall.face;
    appearances_[wall.body].kind = Appearance::Kind::hidden;
  }
  lowest_ = room_.lower.y - body_size_ * kPlate;
  for (std::uint32_t i = 0; i < scene_.bodies.size(); ++i) {
    const BodyDef& body = scene_.bodies[i];
    if (movable(body) || appearances_[i].kind == Appearance::Kind::hidden) continue;
    obstacles_.push_back(i);
    if (is_wall(body.shape) || is_mesh(body.shape)) continue;
    lowest_ = std::min(lowest_, body.position.y - size_of(body.shape));
  }
  find_terrain(bounds);
}

// A ground below a terrain would be visible beyond its border, at a different height.
void ScenePainter::find_terrain(const Bounds& bounds) {
  for (const std::uint32_t i : obstacles_) {
    const BodyDef& body = scene_.bodies[i];
    const TriangleMesh mesh = mesh_of(body.shape);
    if (!has_surface(mesh)) continue;
    const Aabb box = bounds_of(mesh, body);
    lowest_mesh_ = std::min(lowest_mesh_, box.lower.y - body_size_ * kPlate);
    mesh_reach_ = std::max(mesh_reach_, farthest_distance(box, bounds.centre));
    bool around = true;
    for (const int axis : {0, 2}) {
      around = around && box.lower[axis] <= bounds.centre[axis] - bounds.radius &&
               box.upper[axis] >= bounds.centre[axis] + bounds.radius;
    }
    has_terrain_ = has_terrain_ || around;
  }
}

Paint ScenePainter::paint(std::uint32_t body) const {
  const BodyDef& def = scene_.bodies[body];
  if (is_mesh(def.shape)) return kStone;
  if (!movable(def)) return kConcrete;
  if (std::holds_alternative<Box>(def.shape)) return crate_paint(body);
  Paint paint = ball_paint(body);
  if (std::holds_alternative<Compound>(def.shape)) paint.pattern = Pattern::plain;
  return paint;
}

ScenePainter::Appearance ScenePainter::appearance_of(std::uint32_t body) const {
  const BodyDef& def = scene_.bodies[body];
  if (movable(def)) {
    const Sphere* sphere = std::get_if<Sphere>(&def.shape);
    if (sphere == nullptr) return {Appearance::Kind::moving, paint(body)};
    return {Appearance::Kind::moving_ball, paint(body), sphere->radius};
  }
  Appearance appearance{Appearance::Kind::still, paint(body)};
  if (!def.kinematic) appearance.paint.pattern = Pattern::plain;
  const bool has_lines = std::holds_alternative<Box>(def.shape) || is_mesh(def.shape);
  if (has_lines) appearance.paint.pattern = Pattern::wall;
  return appearance;
}

void ScenePainter::draw_still(const Bounds& bounds, Drawing* drawing) const {
  const Real shadows = std::min(mesh_reach_, body_size_ * kMeshShadows);
  drawing->set_bounds(bounds.centre, std::max(bounds.radius * Real(1.25), shadows));
  drawing->set_detail(body_size_ * Real(1.6));
  const Real cell = cell_for(body_size_);
  for (const std::uint32_t i : obstacles_) {
    const BodyDef& body = scene_.bodies[i];
    if (const HalfSpace* plane = std::get_if<HalfSpace>(&body.shape)) {
      drawing->add_ground(plane->normal, plane->offset, cell, kGroundPaint);
    }
    if (const Plane* plane = std::get_if<Plane>(&body.shape)) {
      // Visible only from the side of the bodies, which are thus never hidden.
      const bool front = dot(plane->normal, bounds.centre) >= plane->offset;
      const Vec3 normal = front ? plane->normal : -plane->normal;
      drawing->add_ground(normal, front ? plane->offset : -plane->offset, cell, kGroundPaint);
    }
  }
  for (const Wall& wall : walls_) draw_wall(wall, drawing);
  // An additional floor, unless bodies could fall through it.
  const bool has_floor = room_.lower.y > -kEndless;
  if (!drawing->grounds().empty() || (falls_ && !has_floor) || has_terrain_) return;
  const Real level = has_floor ? lowest_ : bounds.centre.y - bounds.radius - body_size_;
  drawing->add_ground({0, 1, 0}, std::min(level, lowest_mesh_), cell, kGroundPaint);
}

void ScenePainter::draw_wall(const Wall& wall, Drawing* drawing) const {
  const BodyDef& body = scene_.bodies[wall.body];
  const Vec3 h = std::get<Box>(body.shape).half_extents;
  Vec3 low, high;
  for (int k = 0; k < 3; ++k) {
    low[k] = std::max(body.position[k] - h[k], room_.lower[k]);
    high[k] = std::min(body.position[k] + h[k], room_.upper[k]);
  }
  low[wall.axis] = wall.face - wall.thickness;
  high[wall.axis] = wall.face;
  drawing->add_box((low + high) * Real(0.5), (high - low) * Real(0.5), {},
                   wall.thickness > 0 ? kConcrete : kGlass);
}

void ScenePainter::draw(const RunState& from, const RunState& to, Real share, Colouring colouring,
                        Drawing* drawing) const {
  draw_still(bounds_estimator_.bounds(to.states), drawing);
  const std::vector<Paint> property_paints = body_paints(scene_, to, colouring);
  drawing->reserve_spheres(scene_.bodies.size());
  for (std::uint32_t i = 0; i < appearances_.size(); ++i) {
    const Appearance& appearance = appearances_[i];
    if (appearance.kind == Appearance::Kind::hidden) continue;
    const BodyState shown = interpolate(from.states[i], to.states[i], share);
    Paint paint = appearance.paint;
    if (appearance.kind != Appearance::Kind::still) {
      if (!property_paints.empty()) paint = property_paints[i];
      if (to.awake[i] == 0) paint = dimmed(paint);
    }
    if (appearance.kind == Appearance::Kind::moving_ball) {
      drawing->add_sphere(shown.position, appearance.radius, shown.orientation, paint);
    } else {
      draw_shape(scene_.bodies[i].shape, shown, paint, drawing);
    }
  }
  draw_joints(from, to, share, drawing);
}

void ScenePainter::draw_joints(const RunState& from, const RunState& to, Real share,
                               Drawing* drawing) const {
  const auto point = [&](const BodyId& body, const Vec3& anchor) {
    return to_world_point(interpolate(from.states[body.index], to.states[body.index], share),
                          anchor);
  };
  const auto draw_one = [&](const auto& joint) {
    const Vec3 end = joint.b ? point(*joint.b, joint.anchor_b) : joint.anchor_b;
    drawing->add_line(point(joint.a, joint.anchor_a), end, {235, 235, 225}, 3.0f);
  };
  for (const Joint& joint : scene_.joints) std::visit(draw_one, joint);
}

void ScenePainter::draw_immovable(const Bounds& bounds, Drawing* drawing) const {
  draw_still(bounds, drawing);
  for (const std::uint32_t i : obstacles_) {
    const BodyDef& body = scene_.bodies[i];
    draw_shape(body.shape, {body.position, body.orientation, {}, {}}, appearances_[i].paint,
               drawing);
  }
}

void ScenePainter::draw_shape(const Shape& shape, const BodyState& at, Paint paint,
                              Drawing* drawing) const {
  if (is_mesh(shape)) {
    drawing->add_mesh(mesh_of(shape), at.position, at.orientation, cell_for(body_size_), paint);
  }
  for_each_solid(shape, at, [&](const auto& solid, const BodyState& state) {
    drawing->add_solid(solid, state.position, state.orientation, paint);
  });
}

void ScenePainter::draw_contacts(const std::vector<Contact>& contacts, bool red,
                                 Drawing* drawing) const {
  for (const Contact& contact : contacts) {
    const bool still = scene_.bodies[contact.b.index].mass == 0;
    const Paint paint = red ? Paint{255, 30, 20} : still ? Paint{255, 170, 40} : Paint{60, 255, 90};
    const Vec3 end = contact.point + contact.normal * (body_size_ * Real(0.7));
    drawing->add_line(contact.point, end, paint, red ? 4.0f : 2.0f);
    drawing->add_line(contact.point, contact.point, paint, red ? 10.0f : 6.0f);
  }
}

void ScenePainter::draw_forces(const RunState& before, const RunState& now,
                               Drawing* drawing) const {
  view::draw_forces(scene_, before, now, body_size_ * Real(2.2), drawing);
}

void ScenePainter::draw_mark(const RunState& from, const RunState& to, Real share,
                             std::uint32_t body, Drawing* drawing) const {
  const Shape& shape = scene_.bodies[body].shape;
  const Box* box = std::get_if<Box>(&shape);
  const Real size = size_of(shape);
  const Vec3 half = (box != nullptr ? box->half_extents : Vec3{size, size, size}) * Real(1.06);
  const BodyState shown = interpolate(from.states[body], to.states[body], share);
  const Transform pose = make_transform(shown.orientation, shown.position);
  const auto corner = [&](int bits) {
    const auto side = [bits](int axis) { return (bits >> axis & 1) != 0 ? Real(1) : Real(-1); };
    return transform_point(pose, component_product(half, {side(0), side(1), side(2)}));
  };
  for (int start = 0; start < 8; ++start) {
    for (int axis = 0; axis < 3; ++axis) {
      const int end = start | 1 << axis;
      if (end != start) drawing->add_line(corner(start), corner(end), {255, 240, 120}, 2.0f);
    }
  }
}

std::optional<std::uint32_t> ScenePainter::pick(const RunState& from, const RunState& to,
                                                Real share, const Vec3& eye,
                                                const Vec3& direction) const {
  std::optional<std::uint32_t> found;
  Real nearest = kMaxReal;
  for (std::uint32_t i = 0; i < scene_.bodies.size(); ++i) {
    const BodyDef& def = scene_.bodies[i];
    if (!movable(def)) continue;
    const BodyState state = interpolate(from.states[i], to.states[i], share);
    const Real distance = ray_distance(def.shape, state, eye, direction);
    if (distance < nearest) {
      nearest = distance;
      found = i;
    }
  }
  return found;
}

}  // namespace view
}  // namespace JFPX_ABI
}  // namespace jfpx
