/// Decomposition of bodies into sub-shapes, and their poses.
#include "src/world/bodies/sub_shape_table.hpp"

#include "src/base/parallel_for.hpp"

#include <numeric>

namespace jfpx {
inline namespace JFPX_ABI {
namespace {

/// The range of a sub-shape.
template <class S>
std::uint32_t range_of(const S&, bool is_movable) {
  if constexpr (detail::kIsSolid<S>) {
    return SubShapeRanges::range_of(detail::kSolidKind<S>, is_movable);
  } else if constexpr (detail::kIsMesh<S>) {
    return SubShapeRanges::kMeshes;
  } else {
    return SubShapeRanges::kWalls;
  }
}

}  // namespace

/// The first pass counts the sub-shapes of each range; the second pass places them.
void SubShapeTable::set_bodies(const BodyStore& bodies, std::span<const BodyId> ids) {
  const auto for_each = [&](const auto& visit) {
    for (const BodyId id : ids) {
      const bool is_movable = bodies.movable(id.index);
      detail::for_each_part(bodies.shape(id.index),
                            [&](const auto& shape, const CompoundPart* part, std::uint32_t number) {
                              visit(id.index, shape, part, number, range_of(shape, is_movable));
                            });
    }
  };
  ranges_ = {};
  std::size_t parts = 0;
  for_each([&](std::uint32_t, const auto&, const CompoundPart* part, std::uint32_t,
               std::uint32_t range) {
    ++ranges_.begin[range + 1];
    parts += part != nullptr ? 1 : 0;
  });
  std::partial_sum(std::begin(ranges_.begin), std::end(ranges_.begin), ranges_.begin);
  body_.resize(ranges_.all());
  number_.resize(ranges_.all());
  bounds_.resize(ranges_.bounded());
  part_.resize(ranges_.bounded());
  solids_.resize(ranges_.bounded() - ranges_.spheres());
  meshes_.resize(ranges_.bounded() - ranges_.meshes_begin());
  walls_.resize(ranges_.all() - ranges_.bounded());
  local_.clear();
  local_.reserve(parts);
  SubShapeRanges next = ranges_;
  for_each([&](std::uint32_t body, const auto& shape, const CompoundPart* part,
               std::uint32_t number, std::uint32_t range) {
    const SubShape i = next.begin[range]++;
    body_[i] = body;
    number_[i] = number;
    using S = std::decay_t<decltype(shape)>;
    if constexpr (detail::kIsMesh<S>) {
      bounds_[i] = {{}, detail::bounding_radius(shape)};
      solids_[i - ranges_.spheres()].solid = detail::enclosing_box(shape);
      meshes_[i - ranges_.meshes_begin()] = detail::view_of(shape);
      part_[i] = 0;
    } else if constexpr (detail::kIsSolid<S>) {
      bounds_[i] = {{}, detail::bounding_radius(shape)};
      if (range > 0) solids_[i - ranges_.spheres()].solid = detail::to_solid(shape);
      part_[i] = 0;
      if (part == nullptr) return;
      local_.push_back(make_transform(part->orientation, part->position));
      part_[i] = static_cast<std::uint32_t>(local_.size());
    } else {
      walls_[i - ranges_.bounded()] = to_wall(shape);
    }
  });
  kinematic_.clear();
  const SubShapeView all = view();
  for (SubShape i = ranges_.fixed_begin(); i < ranges_.bounded(); ++i) {
    all.update_pose(bodies.view_without_ids(), i);
    if (bodies.kinematic(body_[i])) kinematic_.push_back(i);
  }
}

SubShapeView SubShapeTable::view() {
  return {.ranges = ranges_,
          .bodies = body_.data(),
          .numbers = number_.data(),
          .all_bounds = bounds_.data(),
          .solids = solids_.data(),
          .meshes = meshes_.data(),
          .walls = walls_.data(),
          .parts = part_.data(),
          .local = local_.data()};
}

void SubShapeTable::update_poses(const BodyStore& store, ThreadPool* pool) {
  const SubShapeView all = view();
  const BodyView bodies = store.view_without_ids();
  const std::size_t count = ranges_.fixed_begin();
  parallel_for(pool, count, chunk_size(count, 64, 1024), [&](std::size_t first, std::size_t last) {
    for (auto i = static_cast<SubShape>(first); i < last; ++i) all.update_pose(bodies, i);
  });
  for (const SubShape sub_shape : kinematic_) all.update_pose(bodies, sub_shape);
}

void SubShapeTable::update_poses(const BodyStore& store, std::span<const SubShape> sub_shapes,
                                 ThreadPool* pool) {
  const SubShapeView all = view();
  const BodyView bodies = store.view_without_ids();
  const std::size_t count = sub_shapes.size();
  parallel_for(pool, count, chunk_size(count, 64, 1024), [&](std::size_t first, std::size_t last) {
    for (const SubShape i : sub_shapes.subspan(first, last - first)) all.update_pose(bodies, i);
  });
  for (const SubShape sub_shape : kinematic_) all.update_pose(bodies, sub_shape);
}

}  // namespace JFPX_ABI
}  // namespace jfpx
