/// Propagation of a property of bodies through contacts, by repeated sweeps.
#include "src/thesis/wake_propagation.hpp"

#include <algorithm>

namespace jfpx {
inline namespace JFPX_ABI {
namespace {

/// Calls pass(contact) for all contacts, repeatedly, until a sweep changes nothing; `pass` returns
/// true if it has changed a body. Contacts are sorted by body index: a forward sweep propagates
/// along chains of increasing indices, a backward sweep along decreasing ones.
template <class Pass>
void propagate(std::span<const Contact> contacts, const Pass& pass) {
  for (bool changed = true; changed;) {
    changed = false;
    for (const Contact& contact : contacts) changed |= pass(contact);
    if (!changed) return;
    for (std::size_t i = contacts.size(); i-- > 0;) changed |= pass(contacts[i]);
  }
}

}  // namespace

void WakePropagation::operator()(std::span<const Contact> contacts, BodyStore* bodies) {
  const std::vector<std::uint8_t>& awake = bodies->moving.awake;
  propagate(contacts, [&](const Contact& c) {
    const std::uint32_t a = c.a.index, b = c.b.index;
    if (awake[a] == awake[b]) return false;
    const std::uint32_t sleeper = awake[a] != 0 ? b : a;
    if (!bodies->movable(sleeper)) return false;
    bodies->wake_by_contact(sleeper, awake[a] != 0 ? a : b);
    return true;
  });
  if (!bodies->has_moving_kinematic_body()) return;

  const Real woken_motion = bodies->view_without_ids().woken_motion;
  carried_.assign(bodies->capacity(), 0);
  for (const BodyId id : bodies->ids()) {
    carried_[id.index] = bodies->kinematic(id.index) ? awake[id.index] : 0;
  }
  propagate(contacts, [&](const Contact& c) {
    const std::uint32_t a = c.a.index, b = c.b.index;
    if (carried_[a] == carried_[b]) return false;
    const std::uint32_t passenger = carried_[a] != 0 ? b : a;
    if (!bodies->movable(passenger)) return false;
    carried_[passenger] = 1;
    Real& mean_motion = bodies->moving.mean_motion[passenger];
    mean_motion = std::max(mean_motion, woken_motion);
    return true;
  });
}

}  // namespace JFPX_ABI
}  // namespace jfpx
