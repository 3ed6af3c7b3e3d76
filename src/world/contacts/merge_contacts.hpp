/// Merge of two sorted lists of contacts.
#pragma once

#include <jfpx/world.hpp>

#include "src/base/reserve.hpp"

#include <cstddef>
#include <span>
#include <utility>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {

/// Merges the ranges [0, middle) and [middle, size) of a list, both sorted by (a.index, b.index).
/// The merge is stable. Unlike std::inplace_merge(), it allocates only the buffer, which the caller
/// keeps.
inline void merge_by_bodies(std::size_t middle, std::span<Contact> contacts,
                            std::vector<Contact>* buffer) {
  const auto pair_of = [](const Contact& c) { return std::pair(c.a.index, c.b.index); };
  reserve_geometric(buffer, contacts.size() - middle);
  buffer->assign(contacts.begin() + static_cast<std::ptrdiff_t>(middle), contacts.end());
  std::size_t first = middle, second = buffer->size();
  while (second > 0) {
    const Contact& next = (*buffer)[second - 1];
    const bool is_first = first > 0 && pair_of(next) < pair_of(contacts[first - 1]);
    Contact& last = contacts[first + second - 1];
    last = is_first ? contacts[--first] : (*buffer)[--second];
  }
}

}  // namespace JFPX_ABI
}  // namespace jfpx
