/// Decomposition of bodies into sub-shapes, and their poses.
#include "src/world/sub_shape_table.hpp"

#include "src/base/parallel_for.hpp"

#include <algorithm>

namespace jfpx {
inline namespace JFPX_ABI {
namespace {

/// Exceeds the rounding errors of the pair tests, so that bounds never exclude a contact.
constexpr Real kBoundsMargin = 1 + 64 * kEpsilon;

Real bounding_radius(const Sphere& sphere) { return sphere.radius; }
Real bounding_radius(const Box& box) {
  constexpr Real kUnderflowLimit = Real(1e-15);  // below it, squares of floats are inexact or 0
  const Vec3& h = box.half_extents;
  const Real largest = std::max({h.x, h.y, h.z});
  return largest < kUnderflowLimit ? 2 * largest : length(h) * kBoundsMargin;
}

/// Calls visit(sub_shape, part or null, index of the part) for each sub-shape of type T in the
/// body.
template <class T, class Visit>
void for_each_sub_shape(const Shape& shape, Visit visit) {
  if (const auto* whole = std::get_if<T>(&shape)) return visit(*whole, nullptr, 0);
  const auto* compound = std::get_if<Compound>(&shape);
  if (compound == nullptr) return;
  for (std::uint32_t i = 0; i < compound->parts.size(); ++i) {
    const CompoundPart& part = compound->parts[i];
    if (const auto* sub_shape = std::get_if<T>(&part.shape)) visit(*sub_shape, &part, i);
  }
}

}  // namespace

void SubShapeTable::set_bodies(const BodyStore& bodies, std::span<const BodyId> ids) {
  body_.clear();
  number_.clear();
  bounds_.clear();
  boxes_.clear();
  walls_.clear();
  part_.clear();
  local_.clear();
  kinematic_.clear();
  const std::size_t least = ids.size();  // exact without compounds
  body_.reserve(least);
  number_.reserve(least);
  bounds_.reserve(least);
  part_.reserve(least);
  const auto add = [&](std::uint32_t body, Real radius, const CompoundPart* part,
                       std::uint32_t number) {
    body_.push_back(body);
    number_.push_back(number);
    bounds_.push_back({{}, radius});
    part_.push_back(0);
    if (part == nullptr) return;
    local_.push_back(make_transform(part->orientation, part->position));
    part_.back() = static_cast<std::uint32_t>(local_.size());
  };
  for (const BodyId id : ids) {
    for_each_sub_shape<Sphere>(bodies.shape(id.index),
                               [&](const Sphere& s, const CompoundPart* part, std::uint32_t i) {
                                 add(id.index, bounding_radius(s), part, i);
                               });
  }
  sphere_count_ = size();
  for (const bool movable : {true, false}) {
    for (const BodyId id : ids) {
      if (bodies.movable(id.index) != movable) continue;
      for_each_sub_shape<Box>(bodies.shape(id.index),
                              [&](const Box& box, const CompoundPart* part, std::uint32_t i) {
                                add(id.index, bounding_radius(box), part, i);
                                boxes_.push_back({box, {}});
                              });
    }
    if (movable) fixed_begin_ = size();
  }
  for (const BodyId id : ids) {
    const Shape& shape = bodies.shape(id.index);
    if (const auto* half_space = std::get_if<HalfSpace>(&shape)) {
      walls_.push_back({*half_space, false});
    } else if (const auto* plane = std::get_if<Plane>(&shape)) {
      walls_.push_back({{plane->normal, plane->offset}, true});
    } else {
      continue;
    }
    body_.push_back(id.index);
    number_.push_back(0);
  }
  const SubShapeView all = view();
  for (SubShape sub_shape = fixed_begin_; sub_shape < bounded_size(); ++sub_shape) {
    all.update_pose(bodies.view_without_ids(), sub_shape);
    if (bodies.kinematic(body_[sub_shape])) kinematic_.push_back(sub_shape);
  }
}

SubShapeView SubShapeTable::view() {
  return {.sphere_count = sphere_count_,
          .fixed_begin = fixed_begin_,
          .bounded_count = bounded_size(),
          .count = size(),
          .bodies = body_.data(),
          .numbers = number_.data(),
          .all_bounds = bounds_.data(),
          .boxes = boxes_.data(),
          .walls = walls_.data(),
          .parts = part_.data(),
          .local = local_.data()};
}

void SubShapeTable::update_poses(const BodyStore& store, ThreadPool* pool) {
  const SubShapeView all = view();
  const BodyView bodies = store.view_without_ids();
  parallel_for(pool, fixed_begin_, 1024, [&](std::size_t first, std::size_t last) {
    for (auto i = static_cast<SubShape>(first); i < last; ++i) all.update_pose(bodies, i);
  });
  for (const SubShape sub_shape : kinematic_) all.update_pose(bodies, sub_shape);
}

}  // namespace JFPX_ABI
}  // namespace jfpx
