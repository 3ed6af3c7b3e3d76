/// Lookup of contacts by key in a list that is sorted by key.
#pragma once

#include "src/contact_solver/soft_step/contact_set.hpp"

#include <algorithm>
#include <cstdint>
#include <span>

namespace jfpx {
inline namespace JFPX_ABI {
namespace soft_step {

/// Binary search in a range of contacts with the same body a. @returns its index, or `none`
template <class Contact>
JFPX_HD inline std::uint32_t find_contact(const Contact* contacts, std::uint32_t begin,
                                          std::uint32_t end, const ContactKey& key,
                                          std::uint32_t none) {
  while (begin < end) {
    const std::uint32_t middle = begin + (end - begin) / 2;
    const ContactKey& other = contacts[middle].key;
    if (other.b == key.b && other.part_a == key.part_a && other.part_b == key.part_b) return middle;
    const bool is_before = other.b != key.b             ? other.b < key.b
                           : other.part_a != key.part_a ? other.part_a < key.part_a
                                                        : other.part_b < key.part_b;
    if (is_before) {
      begin = middle + 1;
    } else {
      end = middle;
    }
  }
  return none;
}

/// Looks up a sequence of keys on the CPU. Ascending keys take constant time each on average.
template <class Contact>
class ContactLookup {
 public:
  explicit ContactLookup(std::span<const Contact> sorted) : sorted_(sorted) {}

  /// @param index receives the index of the contact
  bool find(const ContactKey& key, std::uint32_t* index) {
    if (is_first_ || (next_ > 0 && key <= sorted_[next_ - 1].key)) {
      is_first_ = false;
      const auto found = std::ranges::lower_bound(sorted_, key, {}, &Contact::key);
      next_ = static_cast<std::size_t>(found - sorted_.begin());
    }
    while (next_ < sorted_.size() && sorted_[next_].key < key) ++next_;
    *index = static_cast<std::uint32_t>(next_);
    return next_ < sorted_.size() && sorted_[next_].key == key;
  }

 private:
  std::span<const Contact> sorted_;
  std::size_t next_ = 0;
  bool is_first_ = true;
};

}  // namespace soft_step
}  // namespace JFPX_ABI
}  // namespace jfpx
