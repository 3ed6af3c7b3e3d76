/// Update of ids and sub-shapes on a device after bodies were added or removed.
#pragma once

#include "src/world/device/step_data.hpp"

#include <cstdint>

namespace jfpx {
inline namespace JFPX_ABI {
namespace device {

/// The arrays of a SubShapeView.
struct SubShapeArrays {
  std::uint32_t *bodies = nullptr, *numbers = nullptr;
  SphereInstance* bounds = nullptr;
  PosedSolid* solids = nullptr;
  Wall* walls = nullptr;
  std::uint32_t* parts = nullptr;
  Transform* local = nullptr;
};

/// The ranges of the sub-shapes of two objects together.
inline SubShapeRanges operator+(const SubShapeRanges& a, const SubShapeRanges& b) {
  SubShapeRanges sum;
  for (std::uint32_t i = 0; i <= SubShapeRanges::kCount; ++i)
    sum.begin[i] = a.begin[i] + b.begin[i];
  return sum;
}

/// Merges the kept items of a sorted array with a sorted array of added items, whose keys must
/// differ from those of kept items.
/// @param key_of,added_key_of  keys by item, ascending
/// @param copy_kept,copy_added receive an item of the arrays and its place in the merged one
template <class Team, class KeyOf, class IsKept, class AddedKeyOf, class CopyKept, class CopyAdded>
JFPX_HD void merge_sorted(const Team& team, std::uint32_t n, const KeyOf& key_of,
                          const IsKept& is_kept, std::uint32_t added_count,
                          const AddedKeyOf& added_key_of, const CopyKept& copy_kept,
                          const CopyAdded& copy_added) {
  // Number of added items whose key is at most that of an item.
  const auto added_up_to = [&](std::uint32_t i) {
    const auto key = key_of(i);
    std::uint32_t first = 0, last = added_count;
    while (first < last) {
      const std::uint32_t middle = first + (last - first) / 2;
      if (key < added_key_of(middle)) {
        last = middle;
      } else {
        first = middle + 1;
      }
    }
    return first;
  };
  const auto size = [&](std::uint32_t i) { return is_kept(i) ? 1u : 0u; };
  const std::uint32_t kept = team.scan(n, size, size, [&](std::uint32_t i, std::uint32_t before) {
    const std::uint32_t end = added_up_to(i);
    for (std::uint32_t k = i == 0 ? 0 : added_up_to(i - 1); k < end; ++k) {
      copy_added(k, before + k);
    }
    if (is_kept(i)) copy_kept(i, before + end);
  });
  const std::uint32_t begin = n == 0 ? 0 : added_up_to(n - 1);
  team.for_each(added_count - begin,
                [&](std::uint32_t k) { copy_added(begin + k, kept + begin + k); });
}

/// Computes the new sorted ids and sub-shapes: removes those of `changed` bodies and inserts those
/// of `added` bodies.
struct MergeProgram {
  static constexpr unsigned kBlocksPerMultiprocessor = tuning::kMerge;
  StepData data;
  const std::uint32_t* changed = nullptr;  ///< slots whose body was added or removed
  std::uint32_t changed_count = 0;
  const BodyId* added_ids = nullptr;
  std::uint32_t added_id_count = 0;
  BodyId* to_ids = nullptr;
  SubShapeView added;
  std::uint32_t part_count = 0, added_part_count = 0;  ///< sizes of SubShapeView::local
  SubShapeArrays to;
  SubShapeRanges* kept = nullptr;  ///< receives the ranges of the kept sub-shapes

  template <class Team>
  JFPX_HD void operator()(const Team& team) const {
    const SubShapeView& before = data.swept_bounds.sub_shapes;
    const BodyId* ids = data.step.bodies.ids;
    team.once([&] { *kept = {}; });
    team.for_each(data.step.bodies.capacity, [&](std::uint32_t i) { data.marked[i] = 0; });
    team.for_each(changed_count, [&](std::uint32_t k) { data.marked[changed[k]] = 1; });
    merge_sorted(
        team, data.step.bodies.count, [&](std::uint32_t i) { return ids[i].index; },
        [&](std::uint32_t i) { return data.marked[ids[i].index] == 0; }, added_id_count,
        [&](std::uint32_t k) { return added_ids[k].index; },
        [&](std::uint32_t i, std::uint32_t place) { to_ids[place] = ids[i]; },
        [&](std::uint32_t k, std::uint32_t place) { to_ids[place] = added_ids[k]; });
    team.for_each_nowait(part_count, [&](std::uint32_t i) { to.local[i] = before.local[i]; });
    team.for_each_nowait(added_part_count,
                         [&](std::uint32_t i) { to.local[part_count + i] = added.local[i]; });
    for (std::uint32_t range = 0; range < SubShapeRanges::kCount; ++range) {
      const std::uint32_t first = before.ranges.begin[range];
      team.count(
          before.ranges.begin[range + 1] - first, [&](std::uint32_t i) { return stays(first + i); },
          &kept->begin[range + 1]);
    }
    team.sync();
    team.once([&] {
      for (std::uint32_t i = 0; i < SubShapeRanges::kCount; ++i)
        kept->begin[i + 1] += kept->begin[i];
    });
    merge_sorted(
        team, before.ranges.all(), [&](std::uint32_t i) { return key(before, i); },
        [&](std::uint32_t i) { return stays(i); }, added.ranges.all(),
        [&](std::uint32_t k) { return key(added, k); },
        [&](std::uint32_t i, std::uint32_t place) { copy(before, i, 0, place); },
        [&](std::uint32_t k, std::uint32_t place) { copy(added, k, part_count, place); });
  }

 private:
  JFPX_HD bool stays(std::uint32_t i) const {
    return data.marked[data.swept_bounds.sub_shapes.bodies[i]] == 0;
  }

  /// Key of the order of SubShapeTable, without the order of parts of a body.
  JFPX_HD static std::uint64_t key(const SubShapeView& view, std::uint32_t i) {
    return std::uint64_t{view.ranges.range_of(i)} << 32 | view.bodies[i];
  }

  /// @param first_part index of the first of the parts of `from`
  JFPX_HD void copy(const SubShapeView& from, std::uint32_t i, std::uint32_t first_part,
                    std::uint32_t place) const {
    to.bodies[place] = from.bodies[i];
    to.numbers[place] = from.numbers[i];
    if (from.is_wall(i)) {
      to.walls[place - (kept->bounded() + added.ranges.bounded())] = from.wall(i);
      return;
    }
    to.bounds[place] = from.bounds(i);
    to.parts[place] = from.parts[i] == 0 ? 0 : from.parts[i] + first_part;
    if (!from.is_sphere(i)) {
      to.solids[place - (kept->spheres() + added.ranges.spheres())] = from.solid(i);
    }
  }
};

}  // namespace device
}  // namespace JFPX_ABI
}  // namespace jfpx
