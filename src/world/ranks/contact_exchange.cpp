/// Contacts of several ranks; see the header.
#include "src/world/ranks/contact_exchange.hpp"

#include <algorithm>
#include <tuple>
#include <utility>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace contact_exchange {
namespace {

using soft_step::ContactKey;
using soft_step::ManifoldInput;
using soft_step::SphereContactInput;

/// Appends the contacts of several sets for which keep(set, key) is true, each list sorted by key.
/// @param result empty
template <class Keep>
void merge(std::span<const ContactSet* const> sets, const Keep& keep, ContactSet* result) {
  struct Entry {
    ContactKey key;
    std::uint32_t set, index;
  };
  std::vector<Entry> entries;
  const auto list = [&](auto list_of) {
    entries.clear();
    for (std::uint32_t s = 0; s < sets.size(); ++s) {
      const auto& contacts = sets[s]->*list_of;
      const auto before = static_cast<std::ptrdiff_t>(entries.size());
      for (std::uint32_t i = 0; i < contacts.size(); ++i) {
        if (keep(s, contacts[i].key)) entries.push_back({contacts[i].key, s, i});
      }
      std::ranges::inplace_merge(entries, entries.begin() + before, {}, &Entry::key);
    }
  };
  const bool has_rolling =
      std::ranges::any_of(sets, [](const ContactSet* set) { return set->has_rolling(); });
  const auto append_state = [&](const ContactSet& from, std::size_t contact,
                                std::size_t first_impulse, std::uint32_t impulses) {
    const auto first = from.impulses.begin() + static_cast<std::ptrdiff_t>(first_impulse);
    result->impulses.insert(result->impulses.end(), first, first + impulses);
    result->colors.push_back(from.colors[contact]);
    if (has_rolling) result->rolling_impulses.push_back(from.rolling_impulse(contact));
  };
  list(&ContactSet::spheres);
  for (const Entry& entry : entries) {
    const ContactSet& from = *sets[entry.set];
    result->spheres.push_back(from.spheres[entry.index]);
    append_state(from, entry.index, entry.index, 1);
  }
  list(&ContactSet::manifolds);
  for (const Entry& entry : entries) {
    const ContactSet& from = *sets[entry.set];
    ManifoldInput manifold = from.manifolds[entry.index];
    const std::uint32_t first =
        std::exchange(manifold.first, static_cast<std::uint32_t>(result->points.size()));
    const auto point = from.points.begin() + first;
    result->points.insert(result->points.end(), point, point + manifold.count);
    result->manifolds.push_back(manifold);
    append_state(from, from.spheres.size() + entry.index, from.spheres.size() + first,
                 manifold.count);
  }
}

/// The contacts of a set for which keep(key) is true.
template <class Keep>
ContactSet selected(const ContactSet& set, const Keep& keep) {
  ContactSet result;
  const ContactSet* const sets[] = {&set};
  merge(
      sets, [&](std::uint32_t, const ContactKey& key) { return keep(key); }, &result);
  return result;
}

void write(const ContactSet& set, Communicator::Message* message) {
  append_list(message, set.spheres);
  append_list(message, set.manifolds);
  append_list(message, set.points);
  append_list(message, set.impulses);
  append_list(message, set.rolling_impulses);
  append_list(message, set.colors);
}
ContactSet read(const Communicator::Message& message) {
  ContactSet set;
  if (message.empty()) return set;
  MessageReader reader(message);
  reader.append_to(&set.spheres);
  reader.append_to(&set.manifolds);
  reader.append_to(&set.points);
  reader.append_to(&set.impulses);
  reader.append_to(&set.rolling_impulses);
  reader.append_to(&set.colors);
  return set;
}

/// Merges the contacts of the set for which keep(key) is true with those of messages.
template <class Keep>
void merge_received(std::span<const Communicator::Message> received, const Keep& keep,
                    ContactSet* set) {
  std::vector<ContactSet> others;
  for (const Communicator::Message& message : received) others.push_back(read(message));
  std::vector<const ContactSet*> sets{set};
  for (const ContactSet& other : others) sets.push_back(&other);
  ContactSet result;
  merge(
      sets, [&](std::uint32_t s, const ContactKey& key) { return s > 0 || keep(key); }, &result);
  *set = std::move(result);
}

/// Restores the order by key after a few contacts were appended.
template <class Contact>
void sort_appended(std::vector<Contact>* list, std::size_t before) {
  const auto middle = list->begin() + static_cast<std::ptrdiff_t>(before);
  std::vector<Contact> appended(middle, list->end());
  std::ranges::sort(appended, {}, &Contact::key);
  // Each of them moves the contacts between it and the next one, as one block.
  auto end = middle, to = list->end();
  for (std::size_t k = appended.size(); k-- > 0;) {
    const auto place =
        std::ranges::lower_bound(list->begin(), end, appended[k].key, {}, &Contact::key);
    to = std::move_backward(place, end, to);
    *--to = appended[k];
    end = place;
  }
}

}  // namespace

void share_detected(Domain* domain, std::span<const std::uint32_t> crossing, ContactSet* set) {
  // This rank has found all contacts in the set, so the other body is the foreign one.
  struct Sent {
    std::vector<SphereContactInput> spheres;
    std::vector<ManifoldInput> manifolds;
    std::vector<soft_step::PointInput> points;
  };
  std::vector<Sent> sent(domain->ranks());
  for (const std::uint32_t i : crossing) {
    const SphereContactInput& contact = set->spheres[i];
    sent[domain->owner(contact.key.b)].spheres.push_back(contact);
  }
  for (const ManifoldInput& manifold : set->manifolds) {
    if (!domain->is_foreign(manifold.key.b)) continue;
    Sent& to = sent[domain->owner(manifold.key.b)];
    to.manifolds.push_back(manifold);
    to.manifolds.back().first = static_cast<std::uint32_t>(to.points.size());
    const auto point = set->points.begin() + manifold.first;
    to.points.insert(to.points.end(), point, point + manifold.count);
  }
  const std::span<Communicator::Message> messages = domain->start_messages();
  for (std::size_t r = 0; r < sent.size(); ++r) {
    if (sent[r].spheres.empty() && sent[r].manifolds.empty()) continue;
    append_list(&messages[r], sent[r].spheres);
    append_list(&messages[r], sent[r].manifolds);
    append_list(&messages[r], sent[r].points);
  }
  const std::size_t spheres = set->spheres.size(), manifolds = set->manifolds.size();
  for (const Communicator::Message& message : domain->send()) {
    if (message.empty()) continue;
    MessageReader reader(message);
    reader.append_to(&set->spheres);
    const std::size_t before = set->manifolds.size(), points = set->points.size();
    reader.append_to(&set->manifolds);
    reader.append_to(&set->points);
    for (std::size_t i = before; i < set->manifolds.size(); ++i) {
      set->manifolds[i].first += static_cast<std::uint32_t>(points);
    }
  }
  sort_appended(&set->spheres, spheres);
  sort_appended(&set->manifolds, manifolds);
}

void migrate(Domain* domain, std::span<const Domain::Rank> owner, ContactSet* set) {
  const Domain::Rank mine = domain->rank();
  const auto detector = [&](const ContactKey& key) {
    return owner[key.a] != Domain::kEveryRank ? owner[key.a] : owner[key.b];
  };
  const std::span<Communicator::Message> messages = domain->start_messages();
  for (std::size_t r = 0; r < domain->ranks(); ++r) {
    if (r == mine) continue;
    const auto rank = static_cast<Domain::Rank>(r);
    const auto is_missing = [&](const ContactKey& key) {
      const bool has_now = domain->owner(key.a) == rank || domain->owner(key.b) == rank;
      const bool had = owner[key.a] == rank || owner[key.b] == rank;
      return has_now && !had && detector(key) == mine;
    };
    const ContactSet sent = selected(*set, is_missing);
    if (sent.size() > 0) write(sent, &messages[r]);
  }
  merge_received(
      domain->send(), [&](const ContactKey& key) { return domain->takes_part(key.a, key.b); }, set);
}

void keep_own(const Domain& domain, ContactSet* set) {
  *set = selected(*set, [&](const ContactKey& key) { return domain.takes_part(key.a, key.b); });
}

void gather(Domain* domain, ContactSet* set) {
  const auto is_found = [&](const ContactKey& key) { return domain->detects(key.a, key.b); };
  Communicator::Message message;
  write(selected(*set, is_found), &message);
  merge_received(domain->send_to_all(message), is_found, set);
}

void gather(Domain* domain, DetectedContacts* contacts) {
  struct State {
    std::uint32_t body;
    Vec3 position, velocity, angular_velocity;
  };
  const bool has_velocities = !contacts->velocity.empty();
  std::vector<State> states;
  for (const std::uint32_t body : domain->mine()) {
    if (!domain->is_mine(body) || body >= contacts->position.size()) continue;
    State state{body, contacts->position[body], {}, {}};
    if (has_velocities) {
      state.velocity = contacts->velocity[body];
      state.angular_velocity = contacts->angular_velocity[body];
    }
    states.push_back(state);
  }
  const auto middle =
      contacts->contacts.begin() + static_cast<std::ptrdiff_t>(contacts->sphere_count);
  const std::vector<Contact> spheres(contacts->contacts.begin(), middle);
  const std::vector<Contact> others(middle, contacts->contacts.end());
  Communicator::Message message;
  append_list(&message, states);
  append_list(&message, spheres);
  append_list(&message, others);
  std::vector<Contact> all_spheres = spheres, all_others = others;
  for (const Communicator::Message& received : domain->send_to_all(message)) {
    if (received.empty()) continue;
    MessageReader reader(received);
    states.clear();
    reader.append_to(&states);
    for (const State& state : states) {
      contacts->position[state.body] = state.position;
      if (!has_velocities) continue;
      contacts->velocity[state.body] = state.velocity;
      contacts->angular_velocity[state.body] = state.angular_velocity;
    }
    reader.append_to(&all_spheres);
    reader.append_to(&all_others);
  }
  // The contacts of two bodies are of one rank and remain in their order.
  const auto by_bodies = [](const Contact& x, const Contact& y) {
    return std::tie(x.a.index, x.b.index) < std::tie(y.a.index, y.b.index);
  };
  std::ranges::stable_sort(all_spheres, by_bodies);
  std::ranges::stable_sort(all_others, by_bodies);
  contacts->sphere_count = all_spheres.size();
  contacts->contacts = std::move(all_spheres);
  contacts->contacts.insert(contacts->contacts.end(), all_others.begin(), all_others.end());
}

}  // namespace contact_exchange
}  // namespace JFPX_ABI
}  // namespace jfpx
