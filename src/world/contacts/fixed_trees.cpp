/// Construction and refitting of the trees of the solids of mass 0.
#include "src/world/contacts/fixed_trees.hpp"

#include <utility>

namespace jfpx {
inline namespace JFPX_ABI {

void FixedTrees::set_bodies(const SubShapeTable& table, const SweptBounds& bounds) {
  const SubShapeRanges& ranges = table.ranges();
  next_keys_.clear();
  for (std::uint32_t i = ranges.fixed_begin(); i < ranges.bounded(); ++i) {
    const PosedSolid& posed = bounds.sub_shapes.solid(i);
    next_keys_.push_back({posed, posed.solid.hull != nullptr ? posed.solid.hull->serial : 0});
  }
  for (const std::uint32_t i : table.kinematic()) {
    Key& key = next_keys_[i - ranges.fixed_begin()];
    key = {{key.solid.solid, {}}, key.hull, true};
  }
  if (next_keys_ == keys_ && margin_ == bounds.largest_margin) return move_kinematic(bounds);
  std::swap(keys_, next_keys_);
  margin_ = -1;  // forces a rebuild by the next call if this one throws
  build(bounds, false, &immovable_);
  build(bounds, true, &kinematic_);
  margin_ = bounds.largest_margin;
}

void FixedTrees::move_kinematic(const SweptBounds& bounds) {
  // Blocks grow as their bodies move apart.
  constexpr std::uint32_t kStepsPerBuild = 32;
  if (kinematic_.view().block_count == 0) return;
  if (++steps_ % kStepsPerBuild == 0) return build(bounds, true, &kinematic_);
  const std::uint32_t first = bounds.sub_shapes.ranges.fixed_begin();
  kinematic_.refit([&](std::uint32_t item) { return bounds.tree_bounds(first + item); });
}

void FixedTrees::build(const SweptBounds& bounds, bool is_kinematic, BlockTree* tree) {
  const std::uint32_t first = bounds.sub_shapes.ranges.fixed_begin();
  items_.clear();
  bounds_.clear();
  for (std::uint32_t item = 0; item < keys_.size(); ++item) {
    if (keys_[item].is_kinematic != is_kinematic) continue;
    items_.push_back(item);
    bounds_.push_back(bounds.tree_bounds(first + item));
  }
  tree->build(bounds_, items_);
}

}  // namespace JFPX_ABI
}  // namespace jfpx
