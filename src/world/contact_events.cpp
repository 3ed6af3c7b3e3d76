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

/// Most contacts are between spheres and already sorted, so only the part after the first sorted
/// run is sorted and then merged with it.
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

void ContactEvents::compute(std::span<const Contact> before, std::span<const Contact> after) const {
  before_.start(before);
  after_.start(after);
  events_.clear();
  const auto add = [this](ContactEvent event, ContactPhase phase) {
    event.phase = phase;
    events_.push_back(event);
  };
  while (!before_.at_end() || !after_.at_end()) {
    if (before_.at_end() || (!after_.at_end() && after_.pair() < before_.pair())) {
      add(after_.take(), ContactPhase::begin);
    } else if (after_.at_end() || before_.pair() < after_.pair()) {
      add(before_.take(), ContactPhase::end);
    } else {
      const ContactEvent old = before_.take(), now = after_.take();
      const bool stays = now.a == old.a && now.b == old.b;
      // A new body may have the index of an old one.
      if (!stays) add(old, ContactPhase::end);
      add(now, stays ? ContactPhase::stay : ContactPhase::begin);
    }
  }
}

std::span<const ContactEvent> ContactEvents::between(std::span<const Contact> before,
                                                     std::span<const Contact> after) const {
  if (!current_.load(std::memory_order_acquire)) {
    const std::lock_guard lock(computing_);
    if (!current_.load(std::memory_order_relaxed)) {
      compute(before, after);
      current_.store(true, std::memory_order_release);
    }
  }
  return events_;
}

}  // namespace JFPX_ABI
}  // namespace jfpx
