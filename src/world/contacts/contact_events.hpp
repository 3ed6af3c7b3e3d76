/// Events of contacts between bodies: begin, stay and end.
#pragma once

#include <jfpx/world.hpp>

#include "src/base/lazy.hpp"

#include <cstddef>
#include <span>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {

/// Compares the contacts of two steps on demand. Buffers grow and never shrink.
class ContactEvents {
 public:
  /// Must be called when one of the lists of contacts changes.
  void invalidate() noexcept { comparison_.invalidate(); }
  /// Events between two lists of detected contacts, sorted by (a.index, b.index); an end event
  /// precedes a begin event with the same indices. Valid until invalidate(). Several threads may
  /// call it with the same lists.
  /// @throws std::bad_alloc; the next call tries again
  std::span<const ContactEvent> between(std::span<const Contact> before,
                                        std::span<const Contact> after) const {
    return comparison_.get([&](Comparison* comparison) { comparison->compute(before, after); })
        .events;
  }

 private:
  /// A contact and the pair of its bodies.
  struct Entry {
    std::uint64_t pair;     ///< lower body index in the upper half, higher one in the lower half
    std::uint32_t contact;  ///< index in the contacts
    friend auto operator<=>(const Entry&, const Entry&) = default;
  };
  /// The pairs of a list of contacts, in ascending order.
  class PairList {
   public:
    void start(std::span<const Contact> contacts);
    bool at_end() const { return next_ == sorted_.size(); }
    std::uint64_t pair() const { return sorted_[next_].pair; }
    /// The current pair as an event without phase. Advances to the next pair.
    ContactEvent take();

   private:
    std::span<const Contact> contacts_;
    std::vector<Entry> found_, sorted_;
    std::size_t next_ = 0;
  };
  struct Comparison {
    PairList before, after;
    std::vector<ContactEvent> events;

    void compute(std::span<const Contact> contacts_before, std::span<const Contact> contacts_after);
  };

  Lazy<Comparison> comparison_;
};

}  // namespace JFPX_ABI
}  // namespace jfpx
