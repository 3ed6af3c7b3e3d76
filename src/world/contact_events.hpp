/// Who begins to touch whom, who goes on, and who ceases.
#pragma once

#include <jfpx/world.hpp>

#include "src/world/body_store.hpp"

#include <cstddef>
#include <span>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {

/// Compares the contacts of a step with those of the last step that succeeded. Buffers only grow.
class ContactEvents {
 public:
  /// If memory runs out, nothing has changed.
  /// @param contacts all of a step; a and b are indices of `bodies`
  void update(const BodyStore& bodies, std::span<const Contact> contacts);
  /// Forgets the events, but not who touched.
  void clear() noexcept { cleared_ = true; }
  /// Sorted by (a.index, b.index); an end before the beginning that takes its indices.
  std::span<const ContactEvent> list() const noexcept {
    return cleared_ ? std::span<const ContactEvent>() : events_;
  }

 private:
  /// A contact and the pair of indices that it belongs to, lower one first.
  struct Entry {
    std::uint64_t pair;
    std::uint32_t contact;
    friend auto operator<=>(const Entry&, const Entry&) = default;
  };

  void sort(std::span<const Contact> contacts);
  ContactEvent next_pair(const BodyStore& bodies, std::span<const Contact> contacts,
                         std::size_t* entry) const;

  std::vector<Entry> found_, sorted_;
  std::vector<ContactEvent> events_, next_;
  bool cleared_ = false;
};

}  // namespace JFPX_ABI
}  // namespace jfpx
