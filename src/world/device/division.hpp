/// Division of the items of a step among the devices that share it.
#pragma once

#include <jfpx/config.hpp>

#include "src/base/page_layout.hpp"

#include <cstdint>

namespace jfpx {
inline namespace JFPX_ABI {
namespace device {

inline constexpr std::uint32_t kNone = 0xffffffffu;

/// Largest number of devices that share a step.
inline constexpr std::uint32_t kMostParts = 8;

/// Range of a list.
struct alignas(8) Range {
  std::uint32_t begin = 0, end = 0;
};

/// The shares of the parts in the items of a list: consecutive items, in the order of parts.
struct Division {
  /// By part: its first item, ascending from 0.
  std::uint32_t begin[kMostParts] = {};

  /// The division of a list whose size is not known: each part has about as many items.
  static Division unknown() {
    Division division;
    division.begin[1] = kNone;
    return division;
  }
  JFPX_HD bool is_known() const { return begin[1] != kNone; }

  /// Gives each part as many of n items.
  static Division equal(std::uint32_t n, std::uint32_t parts) {
    Division division;
    const std::uint64_t all = n;
    for (std::uint32_t part = 0; part < parts; ++part) {
      division.begin[part] = static_cast<std::uint32_t>(all * part / parts);
    }
    return division;
  }
  /// The same division of `to` items instead of `from` ones.
  Division scaled(std::uint64_t from, std::uint64_t to) const {
    Division division;
    for (std::uint32_t part = 0; part < kMostParts; ++part) {
      const std::uint64_t item = from == 0 ? 0 : begin[part] * to / from;
      division.begin[part] = static_cast<std::uint32_t>(item);
    }
    return division;
  }
};
/// The divisions of a step by several parts. A part has the bodies of consecutive slots, and what
/// belongs to them, so that most memory that it uses is its own.
struct Divisions {
  Division slots, bodies, sub_shapes, places, blocks, pairs;
  Division spheres, manifolds;  ///< contacts of two spheres, and others
  Division contacts;            ///< numbers of contacts

  /// @returns null for an array that is not divided so
  const Division* of(ArrayIndex index) const {
    switch (index) {
      case ArrayIndex::slot:
        return &slots;
      case ArrayIndex::body:
        return &bodies;
      case ArrayIndex::sub_shape:
        return &sub_shapes;
      case ArrayIndex::place:
        return &places;
      case ArrayIndex::block:
        return &blocks;
      case ArrayIndex::contact:
        return &contacts;
      case ArrayIndex::manifold:
        return &manifolds;
      case ArrayIndex::pair:
        return &pairs;
      case ArrayIndex::equal:
      case ArrayIndex::of_first:
        break;
    }
    return nullptr;
  }
};

/// The share of a part in n items. @param division null: all parts have about as many
JFPX_HD inline Range range_of_part(std::uint32_t n, std::uint32_t part, std::uint32_t parts,
                                   const Division* division = nullptr) {
  if (parts == 1) return {0, n};
  const auto first = [&](std::uint32_t p) {
    if (p == parts) return n;
    if (division == nullptr || !division->is_known()) {
      return static_cast<std::uint32_t>(std::uint64_t{n} * p / parts);
    }
    return division->begin[p] < n ? division->begin[p] : n;
  };
  return {first(part), first(part + 1)};
}
/// Items of two lists, numbered from the first one on, and how the parts share each.
struct TwoLists {
  std::uint32_t first = 0, second = 0;  ///< number of items
  const Division *division_of_first = nullptr, *division_of_second = nullptr;
};

/// The part that has an item. @param division a known one
JFPX_HD inline std::uint32_t part_of(std::uint32_t item, std::uint32_t parts,
                                     const Division& division) {
  std::uint32_t part = 0;
  while (part + 1 < parts && item >= division.begin[part + 1]) ++part;
  return part;
}

}  // namespace device
}  // namespace JFPX_ABI
}  // namespace jfpx
