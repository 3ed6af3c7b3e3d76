/// Computation of contact events by a merge of the sorted pairs of two steps.
#include "src/world/contacts/contact_events.hpp"

#include <algorithm>
#include <utility>

namespace jfpx {
inline namespace JFPX_ABI {
namespace {

std::uint64_t pair_of(std::uint32_t low, std::uint32_t high) {
  return std::uint64_t{low} << 32 | high;
}

}  // namespace

/// Sorts only the part after the first sorted run, and merges both. Most contacts are between
/// spheres and already sorted.
void ContactEvents::PairList::start(std::span<const Contact> contacts) {
  contacts_ = contacts;
  next_ = 0;
  found_.clear();
  for (std::uint32_t i = 0; i < contacts.size(); ++i) {
    const auto [low, high] = std::minmax(contacts[i].a.index, contacts[i].b.index);
    found_.push_back({pair_of(low, high), i});
  }
  const auto rest = std::is_sorted_until(found_.begin(), found_.end());
  std::sort(rest, found_.end());
  sorted_.resize(found_.size());
  std::merge(found_.begin(), rest, rest, found_.end(), sorted_.begin());
}

ContactEvent ContactEvents::PairList::take() {
  const std::uint64_t pair = sorted_[next_].pair;
  const Contact* deepest = &contacts_[sorted_[next_].contact];
  ContactEvent event;
  for (; next_ < sorted_.size() && sorted_[next_].pair == pair; ++next_, ++event.contacts) {
    const Contact& contact = contacts_[sorted_[next_].contact];
    if (contact.distance < deepest->distance) deepest = &contact;
  }
  const bool swapped = deepest->a.index > deepest->b.index;
  event.a = swapped ? deepest->b : deepest->a;
  event.b = swapped ? deepest->a : deepest->b;
  event.normal = swapped ? -deepest->normal : deepest->normal;
  event.point = deepest->point;
  event.distance = deepest->distance;
  return event;
}

void ContactEvents::Comparison::compute(std::span<const Contact> contacts_before,
                                        std::span<const Contact> contacts_after) {
  before.start(contacts_before);
  after.start(contacts_after);
  events.clear();
  const auto add = [this](ContactEvent event, ContactPhase phase) {
    event.phase = phase;
    events.push_back(event);
  };
  while (!before.at_end() || !after.at_end()) {
    if (before.at_end() || (!after.at_end() && after.pair() < before.pair())) {
      add(after.take(), ContactPhase::begin);
    } else if (after.at_end() || before.pair() < after.pair()) {
      add(before.take(), ContactPhase::end);
    } else {
      const ContactEvent old = before.take(), now = after.take();
      const bool stays = now.a == old.a && now.b == old.b;
      // A new body may reuse the index of a removed one.
      if (!stays) add(old, ContactPhase::end);
      add(now, stays ? ContactPhase::stay : ContactPhase::begin);
    }
  }
}

}  // namespace JFPX_ABI
}  // namespace jfpx
