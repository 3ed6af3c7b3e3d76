/// Appends a varying number of values for each item of a range, on a thread pool.
#pragma once

#include "src/base/parallel_for.hpp"
#include "src/base/reserve.hpp"

#include <cstddef>
#include <numeric>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {

/// Appends the values of all items in the order of the items. Both functions are called once for
/// each item, from any thread, first all calls of count_of().
/// @param chunk    number of items that a thread processes together
/// @param count_of function of the number of an item to the number of its values
/// @param write    function of an item and the place of its first value; returns the end
/// @param begin    a buffer that callers may keep
/// @throws std::bad_alloc
template <class T, class Count, class Write>
void parallel_append(ThreadPool* pool, std::size_t items, std::size_t chunk, const Count& count_of,
                     const Write& write, std::vector<std::size_t>* begin, std::vector<T>* list) {
  const std::size_t chunks = (items + chunk - 1) / chunk;
  assign_geometric(begin, chunks + 1, 0);
  parallel_for(pool, items, chunk, [&](std::size_t first, std::size_t last) {
    std::size_t count = 0;
    for (std::size_t i = first; i < last; ++i) count += count_of(i);
    (*begin)[first / chunk] = count;
  });
  std::exclusive_scan(begin->begin(), begin->end(), begin->begin(), list->size());
  resize_geometric(list, (*begin)[chunks]);
  parallel_for(pool, items, chunk, [&](std::size_t first, std::size_t last) {
    T* next = list->data() + (*begin)[first / chunk];
    for (std::size_t i = first; i < last; ++i) next = write(i, next);
  });
}

}  // namespace JFPX_ABI
}  // namespace jfpx
