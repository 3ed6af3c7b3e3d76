/// The heap's moves (Sedgewick, Wayne: Algorithms, 2.4, index priority queue).
#include "src/indexed_heap.hpp"

#include <numeric>

namespace jfpx::inline JFPX_ABI {

bool IndexedHeap::before(std::uint32_t a, std::uint32_t b) const {
  return keys_[a] > keys_[b] || (keys_[a] == keys_[b] && a < b);
}

void IndexedHeap::put(std::size_t place, std::uint32_t number) {
  heap_[place] = number;
  place_[number] = static_cast<std::uint32_t>(place);
}

void IndexedHeap::assign(std::span<const Real> keys) {
  keys_.assign(keys.begin(), keys.end());
  heap_.resize(keys.size());
  place_.resize(keys.size());
  std::iota(heap_.begin(), heap_.end(), 0u);
  std::iota(place_.begin(), place_.end(), 0u);
  for (std::size_t place = heap_.size() / 2; place-- > 0;) sift_down(place);
}

void IndexedHeap::update(std::uint32_t number, Real key) {
  const Real old = keys_[number];
  keys_[number] = key;
  if (key > old) {
    sift_up(place_[number]);
  } else if (key < old) {
    sift_down(place_[number]);
  }
}

void IndexedHeap::sift_up(std::size_t place) {
  const std::uint32_t number = heap_[place];
  for (; place > 0; place = (place - 1) / 2) {
    const std::uint32_t parent = heap_[(place - 1) / 2];
    if (!before(number, parent)) break;
    put(place, parent);
  }
  put(place, number);
}

void IndexedHeap::sift_down(std::size_t place) {
  const std::uint32_t number = heap_[place];
  for (std::size_t child = 2 * place + 1; child < heap_.size(); child = 2 * place + 1) {
    if (child + 1 < heap_.size() && before(heap_[child + 1], heap_[child])) ++child;
    if (!before(heap_[child], number)) break;
    put(place, heap_[child]);
    place = child;
  }
  put(place, number);
}

}  // namespace jfpx::inline JFPX_ABI
