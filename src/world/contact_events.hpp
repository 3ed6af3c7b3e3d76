/// Beginning, continuing and ending contacts between bodies.
#pragma once

#include <jfpx/world.hpp>

#include <cstddef>
#include <span>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {

/// Compares the contacts of a step with those of the last successful step. Buffers grow and never
/// shrink.
class ContactEvents {
 public:
  /// A failed allocation leaves the events unchanged.
  /// @param contacts all of a step
  void update(std::span<const Contact> contacts);
  /// Clears the list of events, but keeps the pairs for the next comparison.
  void clear() noexcept { cleared_ = true; }
  /// Sorted by (a.index, b.index); an end event precedes a begin event with the same indices.
  std::span<const ContactEvent> list() const noexcept {
    return cleared_ ? std::span<const ContactEvent>() : events_;
  }

 private:
  /// A contact and the pair of its body indices, the lower one first.
  struct Entry {
    std::uint64_t pair;
    std::uint32_t contact;
    friend auto operator<=>(const Entry&, const Entry&) = default;
  };

  void sort(std::span<const Contact> contacts);
  ContactEvent next_pair(std::span<const Contact> contacts, std::size_t* entry) const;

  std::vector<Entry> found_, sorted_;
  std::vector<ContactEvent> events_, next_;
  bool cleared_ = false;
};

}  // namespace JFPX_ABI
}  // namespace jfpx
