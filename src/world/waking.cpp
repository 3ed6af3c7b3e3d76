/// News that travels along contacts.
#include "src/world/waking.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace {

/// Calls `pass_on` for contacts until none has news. A sweep each way by turns: the contacts are
/// sorted, so one sweep carries the news along all rising chains.
template <class PassOn>
void spread(std::span<const Contact> contacts, const PassOn& pass_on) {
  for (bool changed = true; changed;) {
    changed = false;
    for (const Contact& contact : contacts) changed |= pass_on(contact);
    if (!changed) return;
    for (std::size_t i = contacts.size(); i-- > 0;) changed |= pass_on(contacts[i]);
  }
}

}  // namespace

void Waking::operator()(std::span<const Contact> contacts, BodyStore* bodies) {
  const std::vector<std::uint8_t>& awake = bodies->moving.awake;
  spread(contacts, [&](const Contact& c) {
    if (awake[c.a] == awake[c.b]) return false;
    const std::uint32_t sleeper = awake[c.a] != 0 ? c.b : c.a;
    if (!bodies->movable(sleeper)) return false;
    bodies->wake_by_touch(sleeper, awake[c.a] != 0 ? c.a : c.b);
    return true;
  });
  if (!bodies->carries()) return;

  carried_.assign(bodies->capacity(), 0);
  for (const BodyId id : bodies->ids()) {
    carried_[id.index] = bodies->kinematic(id.index) ? awake[id.index] : 0;
  }
  spread(contacts, [&](const Contact& c) {
    if (carried_[c.a] == carried_[c.b]) return false;
    const std::uint32_t passenger = carried_[c.a] != 0 ? c.b : c.a;
    if (!bodies->movable(passenger)) return false;
    carried_[passenger] = 1;
    bodies->keep_awake(passenger);
    return true;
  });
}

}  // namespace JFPX_ABI
}  // namespace jfpx
