/// The list of contacts in both orders, for every kind of contact.
#pragma once

#include <jfpx/config.hpp>

#include "src/base/interrupt.hpp"

#include <cstdint>
#include <span>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace detail {

/// Sorted list of `items` and their opposites, in linear time.
/// @param items sorted by (a, b), a < b
/// @param spheres number of spheres, greater than every index
/// @param contact_of function from an item to its SphereContact or SpherePair
/// @param opposite function from an item to the item with exchanged spheres
template <class Item, class ContactOf, class Opposite>
std::vector<Item> both_orders(std::span<const Item> items, std::size_t spheres,
                              ContactOf&& contact_of, Opposite&& opposite) {
  // Row i has the contacts of sphere i with lower indices, then those with higher ones.
  std::vector<std::uint64_t> lower(spheres), higher(spheres);
  for_each_interruptible(items.size(), [&](std::size_t i) {
    ++higher[contact_of(items[i]).a];
    ++lower[contact_of(items[i]).b];
  });
  std::uint64_t begin = 0;
  for (std::size_t i = 0; i < spheres; ++i) {
    const std::uint64_t lower_count = lower[i], higher_count = higher[i];
    lower[i] = begin;
    higher[i] = begin + lower_count;
    begin += lower_count + higher_count;
  }
  std::vector<Item> result;
  resize_interruptible(&result, 2 * items.size());
  for_each_interruptible(items.size(), [&](std::size_t i) {
    result[higher[contact_of(items[i]).a]++] = items[i];
    result[lower[contact_of(items[i]).b]++] = opposite(items[i]);
  });
  return result;
}

}  // namespace detail
}  // namespace JFPX_ABI
}  // namespace jfpx
