/// Trees of the solids of mass 0 other than spheres, for the contact search.
#pragma once

#include "src/collide/block_tree.hpp"
#include "src/world/bodies/sub_shape_table.hpp"
#include "src/world/contacts/swept_bounds.hpp"

#include <cstdint>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {

/// Two trees. The tree of immovable solids is rebuilt when one of them is added, removed or moved;
/// the tree of kinematic solids, which move in every step, is refitted in every step.
class FixedTrees {
 public:
  /// Must be called after SubShapeTable::set_bodies().
  /// @param bounds with the swept bounds of the solids of mass 0
  void set_bodies(const SubShapeTable& table, const SweptBounds& bounds);
  /// Updates the bounds of the kinematic solids. @param bounds with their swept bounds
  void move_kinematic(const SweptBounds& bounds);
  FixedTreesView view() const { return {immovable_.view(), kinematic_.view()}; }

 private:
  /// Identity of a solid of mass 0 in the tree; the pose of a kinematic solid is ignored.
  struct Key {
    PosedSolid solid;
    std::uint64_t hull = 0;  ///< HullView::serial, because another hull may have the same address
    bool is_kinematic = false;
    friend bool operator==(const Key&, const Key&) = default;
  };
  void build(const SweptBounds& bounds, bool is_kinematic, BlockTree* tree);

  BlockTree immovable_, kinematic_;
  std::vector<Key> keys_, next_keys_;  ///< of the last build
  Real margin_ = 0;          ///< SweptBounds::largest_margin of the last build; -1: it failed
  std::uint32_t steps_ = 0;  ///< since the tree of the kinematic solids was built
  // During a build.
  std::vector<std::uint32_t> items_;
  std::vector<Aabb> bounds_;
};

}  // namespace JFPX_ABI
}  // namespace jfpx
