/// Takes bodies apart, and keeps their pieces where they belong.
#include "src/piece_table.hpp"

#include <algorithm>

namespace jfpx::inline JFPX_ABI {
namespace {

/// Larger than what the pair tests may find wrongly by rounding, so that a bound never hides a
/// touch.
constexpr Real kMargin = 1 + 64 * kEpsilon;

Real bounding_radius(const Sphere& sphere) { return sphere.radius; }
Real bounding_radius(const Box& box) {
  constexpr Real kSquareIsLost = Real(1e-15);
  const Vec3& h = box.half_extents;
  const Real largest = std::max({h.x, h.y, h.z});
  return largest < kSquareIsLost ? 2 * largest : length(h) * kMargin;
}

/// Calls visit(piece, part or null) for each piece of type T in the body.
template <class T, class Visit>
void for_each_piece(const Shape& shape, Visit visit) {
  if (const auto* whole = std::get_if<T>(&shape)) return visit(*whole, nullptr);
  const auto* assembly = std::get_if<Assembly>(&shape);
  if (assembly == nullptr) return;
  for (const AssemblyPart& part : assembly->parts) {
    if (const auto* piece = std::get_if<T>(&part.shape)) visit(*piece, &part);
  }
}

}  // namespace

void PieceTable::set_bodies(const BodyStore& bodies) {
  body_.clear();
  bounds_.clear();
  boxes_.clear();
  walls_.clear();
  part_.clear();
  local_.clear();
  kinematic_.clear();
  const auto add = [&](std::uint32_t body, Real radius, const AssemblyPart* part) {
    body_.push_back(body);
    bounds_.push_back({{}, radius});
    part_.push_back(0);
    if (part == nullptr) return;
    local_.push_back(make_transform(part->orientation, part->position));
    part_.back() = static_cast<std::uint32_t>(local_.size());
  };
  for (const BodyId id : bodies.ids()) {
    for_each_piece<Sphere>(bodies.shape(id.index), [&](const Sphere& s, const AssemblyPart* part) {
      add(id.index, bounding_radius(s), part);
    });
  }
  sphere_count_ = size();
  for (const bool movable : {true, false}) {
    for (const BodyId id : bodies.ids()) {
      if (bodies.movable(id.index) != movable) continue;
      for_each_piece<Box>(bodies.shape(id.index), [&](const Box& box, const AssemblyPart* part) {
        add(id.index, bounding_radius(box), part);
        boxes_.push_back({box, {}});
      });
    }
    if (movable) fixed_begin_ = size();
  }
  for (Piece piece = fixed_begin_; piece < size(); ++piece) {
    place(bodies, piece);
    if (bodies.kinematic(body_[piece])) kinematic_.push_back(piece);
  }
  for (const BodyId id : bodies.ids()) {
    const Shape& shape = bodies.shape(id.index);
    if (const auto* half_space = std::get_if<HalfSpace>(&shape)) {
      walls_.push_back({*half_space, false});
    } else if (const auto* plane = std::get_if<Plane>(&shape)) {
      walls_.push_back({{plane->normal, plane->offset}, true});
    } else {
      continue;
    }
    body_.push_back(id.index);
  }
}

void PieceTable::place(const BodyStore& bodies) {
  for (Piece piece = 0; piece < fixed_begin_; ++piece) place(bodies, piece);
  for (const Piece piece : kinematic_) place(bodies, piece);
}

void PieceTable::place(const BodyStore& bodies, Piece piece) {
  const std::uint32_t body = body_[piece];
  const Vec3& position = bodies.moving.position[body];
  SphereInstance& bounds = bounds_[piece];
  bounds.centre = position;
  if (is_sphere(piece) && part_[piece] == 0) return;
  Transform pose = make_transform(bodies.moving.orientation[body], position);
  if (part_[piece] != 0) {
    const Transform& local = local_[part_[piece] - 1];
    bounds.centre = transform_point(pose, local.origin);
    if (is_sphere(piece)) return;
    pose = {pose.basis * local.basis, bounds.centre};
  }
  boxes_[piece - sphere_count_].pose = pose;
}

}  // namespace jfpx::inline JFPX_ABI
