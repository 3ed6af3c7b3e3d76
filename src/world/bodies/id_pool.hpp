/// Ids of the bodies or particles of a world: BodyId and ParticleId.
#pragma once

#include "src/base/lazy.hpp"
#include "src/base/reserve.hpp"

#include <cstdint>
#include <span>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {

/// Allocates ids of slot index and generation. The most recently freed slot is reused first, with a
/// new generation. Additions and removals take constant time; the first ids() after a change builds
/// the sorted list.
///
/// Const functions may run concurrently with each other; all others exclude all calls.
/// @tparam Id a struct of `index` and `generation`, both std::uint32_t
template <class Id>
class IdPool {
 public:
  /// Number of slots; all indices are below it.
  std::size_t capacity() const noexcept { return generation_.size(); }
  /// Whether the next add() needs another slot.
  bool is_full() const noexcept { return free_.empty(); }
  /// The index that the next add() uses.
  std::uint32_t next_index() const noexcept {
    return is_full() ? static_cast<std::uint32_t>(capacity()) : free_.back();
  }
  /// Number of ids in use.
  std::size_t size() const noexcept { return size_; }
  bool contains(Id id) const noexcept {
    return is_used(id.index) && generation_[id.index] == id.generation;
  }
  bool is_used(std::uint32_t index) const noexcept {
    return index < capacity() && used_[index] != 0;
  }
  /// The id that currently has the slot, or will have it next.
  Id id(std::uint32_t index) const { return {index, generation_[index]}; }

  /// Ids in use, ascending by index. Valid until the next change.
  std::span<const Id> ids() const noexcept {
    return ids_.get([this](std::vector<Id>* ids) {
      ids->clear();
      for (std::uint32_t i = 0; ids->size() < size_; ++i) {
        if (used_[i] != 0) ids->push_back(id(i));
      }
    });
  }

  /// Reserves memory for `slots` slots in all, exactly. @throws std::bad_alloc
  void reserve(std::size_t slots) {
    for_each_array([slots](auto& array) { array.reserve(slots); });
  }

  /// Adds an unused slot. add(), remove() and ids() do not allocate.
  /// @throws std::bad_alloc; the pool is then unchanged
  void add_slot() {
    const std::size_t slots = capacity() + 1;
    for_each_array([slots](auto& array) { reserve_geometric(&array, slots); });
    used_.push_back(0);
    generation_.push_back(0);
    free_.push_back(static_cast<std::uint32_t>(slots - 1));
  }

  /// Requires !is_full().
  Id add() noexcept {
    const Id added = id(free_.back());
    free_.pop_back();
    use(added.index);
    return added;
  }

  /// Requires contains(id).
  void remove(Id id) noexcept {
    // Ids are unique, so a slot is retired after its last generation.
    if (++generation_[id.index] != 0) free_.push_back(id.index);
    used_[id.index] = 0;
    --size_;
    ids_.invalidate();
  }

  const std::vector<std::uint32_t>& generations() const noexcept { return generation_; }
  /// Unused slots; the last one is used next.
  const std::vector<std::uint32_t>& unused() const noexcept { return free_; }

  /// Replaces all slots. Indices in `unused` must be distinct and below generations.size(); use()
  /// allocates the remaining slots. @throws std::bad_alloc
  void assign(const std::vector<std::uint32_t>& generations,
              const std::vector<std::uint32_t>& unused) {
    reserve(generations.size());
    generation_ = generations;
    free_.assign(unused.begin(), unused.end());  // keeps the memory that is reserved
    used_.assign(generations.size(), 0);
    size_ = 0;
    ids_.invalidate();
  }
  /// Marks a slot as used that is neither used nor in unused().
  void use(std::uint32_t index) noexcept {
    used_[index] = 1;
    ++size_;
    std::vector<Id>* ids = ids_.current();
    const bool is_last = ids != nullptr && (ids->empty() || ids->back().index < index);
    is_last ? ids->push_back(id(index)) : ids_.invalidate();
  }

 private:
  template <class Visit>
  void for_each_array(const Visit& visit) {
    visit(generation_), visit(free_), visit(used_), visit(*ids_.storage());
  }

  std::vector<std::uint32_t> generation_;
  std::vector<std::uint32_t> free_;
  std::vector<std::uint8_t> used_;  ///< by slot: 1 or 0
  std::size_t size_ = 0;
  Lazy<std::vector<Id>> ids_;  ///< sorted by index
};

}  // namespace JFPX_ABI
}  // namespace jfpx
