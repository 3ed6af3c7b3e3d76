/// Events of contacts between bodies: begin, stay and end.
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
  /// Computes the events of a successful step. A failed allocation leaves the events unchanged.
  /// @param contacts all detected contacts of the step, without those of contact generators
  void update(std::span<const Contact> contacts);
  /// Makes list() empty until the next update(), which still compares with the current pairs.
  void clear() noexcept { cleared_ = true; }
  /// Sorted by (a.index, b.index); an end event precedes a begin event with the same indices.
  std::span<const ContactEvent> list() const noexcept {
    return cleared_ ? std::span<const ContactEvent>() : events_;
  }

 private:
  /// A contact and the pair of its bodies.
  struct Entry {
    std::uint64_t pair;     ///< lower body index in the upper half, higher one in the lower half
    std::uint32_t contact;  ///< index in the contacts
    friend auto operator<=>(const Entry&, const Entry&) = default;
  };

  void sort(std::span<const Contact> contacts);
  ContactEvent next_pair(std::span<const Contact> contacts, std::size_t* entry) const;

  std::vector<Entry> found_, sorted_;
  std::vector<ContactEvent> events_, next_;
  bool cleared_ = false;  ///< whether clear() was called after the last update()
};

}  // namespace JFPX_ABI
}  // namespace jfpx
