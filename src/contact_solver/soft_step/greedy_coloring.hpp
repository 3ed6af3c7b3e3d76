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

/// Number of colors of a class. The classes are inner rows and crossing rows (see blocks.hpp).
inline constexpr std::uint8_t kColorsPerClass = 64;
/// Colors of inner rows are the numbers below kColorsPerClass. Those of crossing rows start here,
/// so that the colors of worlds without crossing rows are those of earlier versions in snapshots.
inline constexpr std::uint8_t kFirstCrossingColor = 128;
/// Color of contacts without a free color, which are solved serially.
inline constexpr std::uint8_t kOverflowColor = kColorsPerClass;
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

/// Whether a color is one of inner rows.
JFPX_HD constexpr bool is_inner_color(std::uint32_t color) { return color < kColorsPerClass; }
/// Whether a color is one of inner or crossing rows.
JFPX_HD constexpr bool is_color(std::uint32_t color) {
  return is_inner_color(color) ||
         (color >= kFirstCrossingColor && color < kFirstCrossingColor + kColorsPerClass);
}
/// Number in its class of a color for which is_color() holds.
JFPX_HD constexpr std::uint32_t number_in_class(std::uint32_t color) {
  static_assert(kFirstCrossingColor % kColorsPerClass == 0);
  return color % kColorsPerClass;
}

/// The colors of a body: a set of numbers for each class.
struct UsedColors {
  std::uint64_t inner = 0, crossing = 0;

  JFPX_HD constexpr std::uint64_t& of_class(bool is_inner) { return is_inner ? inner : crossing; }
};

/// The lowest number that is not in a set of numbers; kColorsPerClass if all are.
JFPX_HD inline std::uint32_t lowest_free(std::uint64_t used) {
  static_assert(kColorsPerClass == 64);
#if defined(__CUDA_ARCH__)
  return static_cast<std::uint32_t>(__popcll(used & ~(used + 1)));
#else
  return static_cast<std::uint32_t>(std::countr_one(used));
#endif
}

/// Adds the lowest color of a class that two bodies do not have to both of them. @returns the
/// color, or kOverflowColor if there is none
JFPX_HD inline std::uint8_t take_lowest_color(bool is_inner, UsedColors* of_a, UsedColors* of_b) {
  std::uint64_t &a = of_a->of_class(is_inner), &b = of_b->of_class(is_inner);
  const std::uint32_t number = lowest_free(a | b);
  if (number == kColorsPerClass) return kOverflowColor;
  a |= std::uint64_t{1} << number;
  b |= std::uint64_t{1} << number;
  return static_cast<std::uint8_t>(is_inner ? number : kFirstCrossingColor + number);
}

/// Whether a contact keeps the color of the last step: it has one, and it is of the same class.
JFPX_HD constexpr bool keeps_color(std::uint32_t color, bool is_inner) {
  return is_color(color) && is_inner_color(color) == is_inner;
}

/// Assigns to each new contact the lowest color of its class that neither body has, in the order of
/// a hash of the key. The order depends on the keys only, and random orders need few parallel
/// rounds (Blelloch, Fineman and Shun 2012). A persistent contact keeps its color while its class
/// is the same, except in the overflow, whose contacts are colored again.
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
    const std::uint64_t bit = std::uint64_t{1} << number_in_class(color);
    for (const std::uint32_t body : {a, b}) {
      std::atomic_ref(used_[body].of_class(is_inner_color(color)))
          .fetch_or(bit, std::memory_order_relaxed);
    }
  }
  /// Contacts that one thread adds, in portions. Several threads may add contacts concurrently,
  /// each with its own object.
  class Portion;
  /// Calls assign(contact, color) for the added contacts.
  template <class Assign>
  void finish(const Assign& assign, ThreadPool* pool) {
    sort(pool);
    for (const Uncolored& contact : sorted_) {
      assign(contact.contact,
             take_lowest_color(contact.is_inner, &used_[contact.a], &used_[contact.b]));
    }
  }

 private:
  struct Uncolored {
    std::uint64_t order;
    std::uint32_t contact, a, b;
    bool is_inner;
  };
  void append(std::span<const Uncolored> contacts);
  void sort(ThreadPool* pool);

  std::vector<UsedColors> used_;  ///< by body
  std::mutex mutex_;              ///< guards uncolored_
  std::vector<Uncolored> uncolored_;
  std::vector<Uncolored> sorted_;  ///< by order and number
};

class GreedyColoring::Portion {
 public:
  explicit Portion(GreedyColoring* coloring) : coloring_(coloring) {}
  /// @param contact number of the contact
  void add(const ContactKey& key, std::uint32_t contact, bool is_inner) {
    if (count_ == contacts_.size()) flush();
    contacts_[count_++] = {color_order(key), contact, key.a, key.b, is_inner};
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
