/// Merge of two sorted lists of contacts.
#pragma once

#include <jfpx/world.hpp>

#include "src/base/reserve.hpp"
#include "src/contact_solver/soft_step/contact_set.hpp"

#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {

inline std::pair<std::uint32_t, std::uint32_t> pair_of(const Contact& contact) {
  return {contact.a.index, contact.b.index};
}
inline std::pair<std::uint32_t, std::uint32_t> pair_of(const soft_step::ContactKey& key) {
  return {key.a, key.b};
}

/// Merges the ranges [0, middle) and [middle, size) of a list of contacts or keys, both sorted by
/// (a.index, b.index). The merge is stable. Unlike std::inplace_merge(), it allocates only the
/// buffer, which the caller keeps.
template <class Item>
void merge_by_bodies(std::size_t middle, std::span<Item> items, std::vector<Item>* buffer) {
  reserve_geometric(buffer, items.size() - middle);
  buffer->assign(items.begin() + static_cast<std::ptrdiff_t>(middle), items.end());
  std::size_t first = middle, second = buffer->size();
  while (second > 0) {
    const Item& next = (*buffer)[second - 1];
    const bool is_first = first > 0 && pair_of(next) < pair_of(items[first - 1]);
    Item& last = items[first + second - 1];
    last = is_first ? items[--first] : (*buffer)[--second];
  }
}

}  // namespace JFPX_ABI
}  // namespace jfpx
