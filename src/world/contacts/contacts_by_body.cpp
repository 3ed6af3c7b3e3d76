/// Counting sort of contacts by body; see the header.
#include "src/world/contacts/contacts_by_body.hpp"

#include "src/base/reserve.hpp"

#include <algorithm>
#include <new>
#include <numeric>

namespace jfpx {
inline namespace JFPX_ABI {

bool ContactsByBody::build(std::span<const Contact> contacts) noexcept {
  std::uint32_t highest = 0;
  for (const Contact& c : contacts) highest = std::max({highest, c.a.index, c.b.index});
  try {
    // One additional entry: placing the contacts shifts the limits by one.
    assign_geometric(&begin_, std::size_t{highest} + 3, 0);
    resize_geometric(&of_body_, 2 * contacts.size());
  } catch (const std::bad_alloc&) {
    return false;
  }
  for (const Contact& c : contacts) {
    for (const BodyId body : {c.a, c.b}) ++begin_[body.index + std::size_t{2}];
  }
  std::inclusive_scan(begin_.begin(), begin_.end(), begin_.begin());
  for (std::uint32_t i = 0; i < contacts.size(); ++i) {
    for (const BodyId body : {contacts[i].a, contacts[i].b}) {
      of_body_[begin_[body.index + std::size_t{1}]++] = i;
    }
  }
  return true;
}

}  // namespace JFPX_ABI
}  // namespace jfpx
