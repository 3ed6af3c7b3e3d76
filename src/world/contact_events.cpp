/// Computation of contact events by a merge of the sorted pairs of two steps.
#include "src/world/contact_events.hpp"

#include <algorithm>
#include <utility>

namespace jfpx {
inline namespace JFPX_ABI {
namespace {

std::uint64_t pair_of(std::uint32_t low, std::uint32_t high) {
  return std::uint64_t{low} << 32 | high;
}

}  // namespace

void ContactEvents::update(std::span<const Contact> contacts) {
  sort(contacts);
  next_.clear();
  std::size_t entry = 0;
  const auto end = [this](const ContactEvent& old) {
    next_.push_back(old);
    next_.back().phase = ContactPhase::end;
  };
  for (const ContactEvent& old : events_) {
    if (old.phase == ContactPhase::end) continue;
    const std::uint64_t pair = pair_of(old.a.index, old.b.index);
    while (entry < sorted_.size() && sorted_[entry].pair < pair) {
      next_.push_back(next_pair(contacts, &entry));
    }
    if (entry == sorted_.size() || sorted_[entry].pair > pair) {
      end(old);
      continue;
    }
    ContactEvent now = next_pair(contacts, &entry);
    if (now.a == old.a && now.b == old.b) {
      now.phase = ContactPhase::stay;
    } else {
      end(old);
    }
    next_.push_back(now);
  }
  while (entry < sorted_.size()) next_.push_back(next_pair(contacts, &entry));
  std::swap(events_, next_);
  cleared_ = false;
}

/// Fills sorted_ with the contacts, sorted by pair. Most contacts are between spheres and already
/// sorted, so only the part after the first sorted run is sorted and then merged with it.
void ContactEvents::sort(std::span<const Contact> contacts) {
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

/// Returns a begin event for the pair at position `entry` of sorted_, and advances `entry` to the
/// next pair.
ContactEvent ContactEvents::next_pair(std::span<const Contact> contacts, std::size_t* entry) const {
  const std::uint64_t pair = sorted_[*entry].pair;
  const Contact* deepest = &contacts[sorted_[*entry].contact];
  ContactEvent event;
  for (; *entry < sorted_.size() && sorted_[*entry].pair == pair; ++*entry, ++event.contacts) {
    const Contact& contact = contacts[sorted_[*entry].contact];
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

}  // namespace JFPX_ABI
}  // namespace jfpx
