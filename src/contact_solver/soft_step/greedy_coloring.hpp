/// Greedy coloring of contacts, whose colors persist from step to step.
#pragma once

#include "src/base/thread_pool.hpp"
#include "src/contact_solver/soft_step/contact_set.hpp"

#include <array>
#include <atomic>
#include <bit>
#include <cstdint>
#include <mutex>
#include <span>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace soft_step {

/// Number of colors. Contacts without a free color get kOverflowColor and are solved serially.
inline constexpr std::uint8_t kColors = 64;
inline constexpr std::uint8_t kOverflowColor = kColors;
/// Color of a contact with an immovable or kinematic body, which needs no color.
inline constexpr std::uint8_t kFixedColor = 254;
/// Color of a contact that has not been colored.
inline constexpr std::uint8_t kNoColor = 255;

/// Finalizer of SplitMix64 (Steele, Lea and Flood 2014).
JFPX_HD constexpr std::uint64_t mixed(std::uint64_t x) {
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9u;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebu;
  return x ^ (x >> 31);
}

/// Position of a contact in the order of coloring; ties are ordered by number of contact.
JFPX_HD constexpr std::uint64_t color_order(const ContactKey& key) {
  const std::uint64_t bodies = std::uint64_t{key.a} << 32 | key.b;
  const std::uint64_t parts = std::uint64_t{key.part_a} << 32 | key.part_b;
  return mixed(mixed(bodies + 0x9e3779b97f4a7c15u) ^ parts);
}

/// The lowest color that is not in a set of colors; kOverflowColor if all are.
JFPX_HD inline std::uint8_t lowest_free_color(std::uint64_t used) {
  static_assert(kColors == 64 && kOverflowColor == 64);
#if defined(__CUDA_ARCH__)
  return static_cast<std::uint8_t>(__popcll(used & ~(used + 1)));
#else
  return static_cast<std::uint8_t>(std::countr_one(used));
#endif
}

/// Assigns to each new contact the lowest color that neither body has, in the order of a hash of
/// the key. The order depends on the keys only, and random orders need few parallel rounds
/// (Blelloch, Fineman and Shun 2012). A persistent contact keeps its color, except in the overflow,
/// whose contacts are colored again.
///
/// Usage in a step: start(), keep() for all colored contacts, Portion::add() for all others,
/// finish(). Joints are colored together with the contacts, in the order of the same hash, and
/// numbered after them. Owns its buffers, which grow and never shrink.
class GreedyColoring {
 public:
  /// @param pool null: start() and finish() run in the calling thread
  void start(std::size_t bodies, ThreadPool* pool);
  /// Several threads may call it concurrently.
  void keep(std::uint32_t a, std::uint32_t b, std::uint8_t color) {
    const std::uint64_t bit = std::uint64_t{1} << color;
    std::atomic_ref(used_[a]).fetch_or(bit, std::memory_order_relaxed);
    std::atomic_ref(used_[b]).fetch_or(bit, std::memory_order_relaxed);
  }
  /// Contacts that one thread adds, in portions. Several threads may add contacts concurrently,
  /// each with its own object.
  class Portion;
  /// Calls assign(contact, color) for the added contacts.
  template <class Assign>
  void finish(const Assign& assign, ThreadPool* pool) {
    sort(pool);
    for (const Uncolored& contact : sorted_) {
      std::uint64_t &a = used_[contact.a], &b = used_[contact.b];
      const std::uint8_t color = lowest_free_color(a | b);
      assign(contact.contact, color);
      if (color == kOverflowColor) continue;
      a |= std::uint64_t{1} << color;
      b |= std::uint64_t{1} << color;
    }
  }

 private:
  struct Uncolored {
    std::uint64_t order;
    std::uint32_t contact, a, b;
  };
  void append(std::span<const Uncolored> contacts);
  void sort(ThreadPool* pool);

  std::vector<std::uint64_t> used_;  ///< by body: the set of its colors
  std::mutex mutex_;                 ///< guards uncolored_
  std::vector<Uncolored> uncolored_;
  std::vector<Uncolored> sorted_;  ///< by order and number
};

class GreedyColoring::Portion {
 public:
  explicit Portion(GreedyColoring* coloring) : coloring_(coloring) {}
  /// @param contact number of the contact
  void add(const ContactKey& key, std::uint32_t contact) {
    if (count_ == contacts_.size()) flush();
    contacts_[count_++] = {color_order(key), contact, key.a, key.b};
  }
  /// Must be called after the last add().
  void flush() {
    coloring_->append(std::span(contacts_).first(count_));
    count_ = 0;
  }

 private:
  GreedyColoring* coloring_;
  std::array<Uncolored, 64> contacts_;
  std::size_t count_ = 0;
};

}  // namespace soft_step
}  // namespace JFPX_ABI
}  // namespace jfpx
