/// How the bodies of a scene look, and where they stand.
#include "src/viewer/stage.hpp"

#include "src/viewer/between.hpp"
#include "src/viewer/colours.hpp"
#include "src/viewer/forces.hpp"
#include "src/viewer/islands.hpp"
#include "src/viewer/values.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace jfpx {
inline namespace JFPX_ABI {
namespace view {
namespace {

constexpr Paint kConcrete{168, 168, 166, Pattern::wall};
constexpr Paint kGlass{255, 255, 255, Pattern::glass};
constexpr Real kPlate = Real(0.25);  // thickness of a room's floor, in bodies
constexpr Real kEndless = kMaxReal / 4;

bool movable(const BodyDef& body) { return body.mass > 0; }

/// What colours tell of each body; empty where they only tell bodies apart.
std::vector<Paint> told_paints(const Scene& scene, const Moment& moment, Colouring colouring) {
  if (colouring == Colouring::islands) return island_paints(scene, moment.contacts);
  std::vector<Paint> paints;
  for (const Real value : colour_values(scene, moment, colouring)) {
    paints.push_back(scale_paint(value));
  }
  return paints;
}

int thin_axis(const Vec3& h) {
  int axis = 0;
  for (int i = 1; i < 3; ++i) axis = h[i] < h[axis] ? i : axis;
  return axis;
}

/// A round number of metres near ten bodies: edge of the ground's cells.
Real cell_for(Real body_size) {
  return std::pow(Real(10), std::round(std::log10(std::max(body_size, Real(1e-6)) * 2)));
}

}  // namespace

Stage::Stage(Scene scene) : scene_(std::move(scene)), survey_(scene_) {
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
  for (std::uint32_t i = 0; i < scene_.bodies.size(); ++i) looks_.push_back(look_of(i));
  find_room();
}

std::optional<Stage::Wall> Stage::wall_of(std::uint32_t body, const Bounds& bounds) const {
  const BodyDef& def = scene_.bodies[body];
  const Box* box = std::get_if<Box>(&def.shape);
  if (box == nullptr || movable(def) || def.kinematic || def.orientation != Quat{}) return {};
  // A wall of a cube is 0.8 times as long as what the cube holds.
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

// Large upright boxes around what moves are the walls of a room. They are drawn as glass, cut to
// the inside, so that one can look in. Of several on one side the largest is the wall.
void Stage::find_room() {
  std::vector<BodyState> states;
  for (const BodyDef& body : scene_.bodies) states.push_back({body.position, {}, {}, {}});
  const Bounds bounds = survey_.bounds(states);
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
    looks_[wall.body].kind = Look::Kind::hidden;
  }
  lowest_ = room_.lower.y - body_size_ * kPlate;
  for (std::uint32_t i = 0; i < scene_.bodies.size(); ++i) {
    const BodyDef& body = scene_.bodies[i];
    if (movable(body) || looks_[i].kind == Look::Kind::hidden) continue;
    obstacles_.push_back(i);
    if (!is_endless(body.shape)) lowest_ = std::min(lowest_, body.position.y - size_of(body.shape));
  }
}

Paint Stage::paint(std::uint32_t body) const {
  const BodyDef& def = scene_.bodies[body];
  if (!movable(def)) return kConcrete;
  if (std::holds_alternative<Box>(def.shape)) return crate_paint(body);
  Paint paint = ball_paint(body);
  if (std::holds_alternative<Compound>(def.shape)) paint.pattern = Pattern::plain;
  return paint;
}

Stage::Look Stage::look_of(std::uint32_t body) const {
  const BodyDef& def = scene_.bodies[body];
  if (movable(def)) {
    const Sphere* sphere = std::get_if<Sphere>(&def.shape);
    if (sphere == nullptr) return {Look::Kind::moving, paint(body)};
    return {Look::Kind::moving_ball, paint(body), sphere->radius};
  }
  Look look{Look::Kind::still, paint(body)};
  if (!def.kinematic) look.paint.pattern = Pattern::plain;
  if (std::holds_alternative<Box>(def.shape)) look.paint.pattern = Pattern::wall;
  return look;
}

void Stage::draw_still(const Bounds& bounds, Drawing* drawing) const {
  const Real cell = cell_for(body_size_);
  for (const std::uint32_t i : obstacles_) {
    const BodyDef& body = scene_.bodies[i];
    if (const HalfSpace* plane = std::get_if<HalfSpace>(&body.shape)) {
      drawing->add_ground(plane->normal, plane->offset, cell, kGroundPaint);
    }
    if (const Plane* plane = std::get_if<Plane>(&body.shape)) {
      // Seen from the side where the bodies are, so that it does not hide them.
      const bool front = dot(plane->normal, bounds.centre) >= plane->offset;
      const Vec3 normal = front ? plane->normal : -plane->normal;
      drawing->add_ground(normal, front ? plane->offset : -plane->offset, cell, kGroundPaint);
    }
  }
  for (const Wall& wall : walls_) draw_wall(wall, drawing);
  // A floor to stand on, where nothing can fall through it.
  const bool has_floor = room_.lower.y > -kEndless;
  if (!drawing->grounds().empty() || (falls_ && !has_floor)) return;
  const Real level = has_floor ? lowest_ : bounds.centre.y - bounds.radius - body_size_;
  drawing->add_ground({0, 1, 0}, level, cell, kGroundPaint);
}

void Stage::draw_wall(const Wall& wall, Drawing* drawing) const {
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

void Stage::draw(const Moment& from, const Moment& to, Real share, Colouring colouring,
                 Drawing* drawing) const {
  const Bounds bounds = survey_.bounds(to.states);
  drawing->set_bounds(bounds.centre, bounds.radius * Real(1.25));
  drawing->set_detail(body_size_ * Real(1.6));
  draw_still(bounds, drawing);
  const std::vector<Paint> told = told_paints(scene_, to, colouring);
  drawing->reserve_spheres(scene_.bodies.size());
  for (std::uint32_t i = 0; i < looks_.size(); ++i) {
    const Look& look = looks_[i];
    if (look.kind == Look::Kind::hidden) continue;
    const BodyState shown = between(from.states[i], to.states[i], share);
    Paint paint = look.paint;
    if (look.kind != Look::Kind::still) {
      if (!told.empty()) paint = told[i];
      if (to.awake[i] == 0) paint = dimmed(paint);
    }
    if (look.kind == Look::Kind::moving_ball) {
      drawing->add_sphere(shown.position, look.radius, shown.orientation, paint);
    } else {
      draw_shape(scene_.bodies[i].shape, shown, paint, drawing);
    }
  }
}

void Stage::draw_shape(const Shape& shape, const BodyState& at, Paint paint,
                       Drawing* drawing) const {
  if (const Sphere* sphere = std::get_if<Sphere>(&shape)) {
    drawing->add_sphere(at.position, sphere->radius, at.orientation, paint);
  } else if (const Box* box = std::get_if<Box>(&shape)) {
    drawing->add_box(at.position, box->half_extents, at.orientation, paint);
  } else if (const Compound* compound = std::get_if<Compound>(&shape)) {
    for (const CompoundPart& part : compound->parts) {
      draw_shape(std::visit([](const auto& s) { return Shape(s); }, part.shape), placed(part, at),
                 paint, drawing);
    }
  }
}

void Stage::draw_contacts(const std::vector<Contact>& contacts, bool red, Drawing* drawing) const {
  for (const Contact& contact : contacts) {
    const bool still = scene_.bodies[contact.b].mass == 0;
    const Paint paint = red ? Paint{255, 30, 20} : still ? Paint{255, 170, 40} : Paint{60, 255, 90};
    const Vec3 end = contact.point + contact.normal * (body_size_ * Real(0.7));
    drawing->add_line(contact.point, end, paint, red ? 4.0f : 2.0f);
    drawing->add_line(contact.point, contact.point, paint, red ? 10.0f : 6.0f);
  }
}

void Stage::draw_forces(const Moment& before, const Moment& now, Drawing* drawing) const {
  view::draw_forces(scene_, before, now, body_size_ * Real(2.2), drawing);
}

void Stage::draw_mark(const Moment& from, const Moment& to, Real share, std::uint32_t body,
                      Drawing* drawing) const {
  const Shape& shape = scene_.bodies[body].shape;
  const Box* box = std::get_if<Box>(&shape);
  const Real size = size_of(shape);
  const Vec3 half = (box != nullptr ? box->half_extents : Vec3{size, size, size}) * Real(1.06);
  const BodyState shown = between(from.states[body], to.states[body], share);
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

std::optional<std::uint32_t> Stage::pick(const Moment& from, const Moment& to, Real share,
                                         const Vec3& eye, const Vec3& direction) const {
  std::optional<std::uint32_t> found;
  Real nearest = kMaxReal;
  for (std::uint32_t i = 0; i < scene_.bodies.size(); ++i) {
    const BodyDef& def = scene_.bodies[i];
    if (!movable(def)) continue;
    const BodyState state = between(from.states[i], to.states[i], share);
    const Real distance = std::visit(
        [&](const auto& shape) { return ray_distance(shape, state, eye, direction); }, def.shape);
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
