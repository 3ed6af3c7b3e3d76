/// Contact lists between two sets, of many systems, in both orders and as compressed rows.
#include <jfpx/contact_list.hpp>

#include "src/base/interrupt.hpp"
#include "src/sphere_collider/both_orders.hpp"
#include "src/sphere_collider/sphere_input.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace {

template <class Item>
std::vector<std::uint64_t> offsets_of(std::span<const Item> items, std::size_t rows) {
  std::vector<std::uint64_t> offsets(rows + 1);
  for_each_interruptible(items.size(),
                         [&](std::size_t i) { ++offsets[items[i].a + std::size_t{1}]; });
  for (std::size_t i = 0; i < rows; ++i) offsets[i + 1] += offsets[i];
  return offsets;
}

}  // namespace

std::vector<SphereContact> find_contacts_between(SphereCollider& collider,
                                                 std::span<const SphereInstance> first,
                                                 std::span<const SphereInstance> second) {
  std::vector<SphereInstance> spheres;
  spheres.reserve(first.size() + second.size());
  spheres.insert(spheres.end(), first.begin(), first.end());
  spheres.insert(spheres.end(), second.begin(), second.end());
  std::vector<SphereContact> result;
  // Because a < b, a contact of both sets has its `a` in the first.
  for (SphereContact contact : collider.find_contacts(spheres)) {
    if (contact.a >= first.size()) break;
    if (contact.b < first.size()) continue;
    contact.b -= static_cast<SphereIndex>(first.size());
    result.push_back(contact);
  }
  return result;
}

std::vector<SphereContact> find_contacts_in_systems(SphereCollider& collider,
                                                    std::span<const SphereInstance> spheres,
                                                    std::span<const std::uint64_t> offsets) {
  detail::check_offsets(offsets, spheres.size());
  detail::check_spheres(spheres);  // here, so that messages count all spheres
  std::vector<SphereContact> result;
  for (std::size_t i = 1; i < offsets.size(); ++i) {
    poll_interrupt();
    const std::uint64_t begin = offsets[i - 1];
    for (SphereContact contact :
         collider.find_contacts(spheres.subspan(begin, offsets[i] - begin))) {
      contact.a += static_cast<SphereIndex>(begin);
      contact.b += static_cast<SphereIndex>(begin);
      result.push_back(contact);
    }
  }
  return result;
}

std::vector<SphereContact> in_both_orders(ContactSpan contacts, std::size_t spheres) {
  return detail::both_orders(
      contacts, spheres, [](const SphereContact& c) -> const SphereContact& { return c; },
      [](const SphereContact& c) {
        return SphereContact{.a = c.b, .b = c.a, .normal = -c.normal, .distance = c.distance};
      });
}

std::vector<SpherePair> in_both_orders(std::span<const SpherePair> pairs, std::size_t spheres) {
  return detail::both_orders(
      pairs, spheres, [](const SpherePair& p) { return p; },
      [](const SpherePair& p) {
        return SpherePair{p.b, p.a};
      });
}

std::vector<std::uint64_t> row_offsets(ContactSpan contacts, std::size_t rows) {
  return offsets_of(contacts, rows);
}

std::vector<std::uint64_t> row_offsets(std::span<const SpherePair> pairs, std::size_t rows) {
  return offsets_of(pairs, rows);
}

}  // namespace JFPX_ABI
}  // namespace jfpx
