/// Contacts of a body, for waking the neighbors of bodies that are removed or moved.
#pragma once

#include <jfpx/world.hpp>

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {

/// Index of a list of contacts by body. The first search tests every contact; the second search
/// builds the index, so that many searches take linear time in total. Owns its buffers, which grow
/// and never shrink.
class ContactsByBody {
 public:
  /// Must be called when the list changes.
  void invalidate() noexcept { searches_ = 0; }

  /// Calls visit(contact) for the contacts of a body.
  /// @param contacts the same list in all calls until invalidate()
  template <class Visit>
  void for_each(std::span<const Contact> contacts, BodyId body, const Visit& visit) {
    if (searches_ < 2 && ++searches_ == 2 && !build(contacts)) searches_ = 1;
    if (searches_ < 2) {
      for (const Contact& c : contacts) {
        if (c.a == body || c.b == body) visit(c);
      }
      return;
    }
    if (body.index + std::size_t{1} >= begin_.size()) return;
    for (std::uint32_t i = begin_[body.index]; i < begin_[body.index + 1]; ++i) {
      const Contact& c = contacts[of_body_[i]];
      if (c.a == body || c.b == body) visit(c);
    }
  }

 private:
  /// @returns false if there is no memory
  bool build(std::span<const Contact> contacts) noexcept;

  int searches_ = 0;                    ///< since invalidate(), at most 2; 2: the index exists
  std::vector<std::uint32_t> begin_;    ///< by body index: its first entry in of_body_
  std::vector<std::uint32_t> of_body_;  ///< indices of contacts
};

}  // namespace JFPX_ABI
}  // namespace jfpx
