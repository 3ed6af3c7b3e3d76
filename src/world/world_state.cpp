/// Access to a World between two steps: bodies, states, forces and contact generators.
#include <jfpx/error.hpp>

#include "src/base/parallel_for.hpp"
#include "src/scene/field_fault.hpp"
#include "src/world/world_impl.hpp"

#include <algorithm>
#include <utility>

namespace jfpx {
inline namespace JFPX_ABI {
BodyId World::add(const BodyDef& body) {
  const std::uint64_t number = impl_->store.size();
  validate_body_count(number + 1);
  validate_body(body, number, impl_->scene.solver);
  const BodyId id = impl_->add(body);
  impl_->note_change();
  impl_->contacts.shows_list = false;
  return id;
}

void World::remove(BodyId id) {
  impl_->store.require(id);
  impl_->remove(id);
  impl_->contacts.shows_list = false;
  impl_->note_change();
}

BodyDef World::definition(BodyId id) const {
  return impl_->bodies_with_states().definition(impl_->store.require(id));
}

void World::replace(BodyId id, const BodyDef& body) {
  validate_body(body, impl_->store.require(id), impl_->scene.solver);
  impl_->replace(id, body);
  impl_->note_change();
  impl_->contacts.shows_list = false;
}

std::span<const BodyId> World::bodies() const { return impl_->store.ids(); }

bool World::contains(BodyId id) const noexcept { return impl_->store.contains(id); }

BodyId World::body_at(std::uint32_t index) const {
  const std::span<const BodyId> ids = bodies();
  const auto found = std::ranges::lower_bound(ids, index, {}, &BodyId::index);
  if (found != ids.end() && found->index == index) return *found;
  throw InvalidArgument("index is " + std::to_string(index) +
                        "; it must be that of a living body of this world");
}

const Shape& World::shape(BodyId id) const { return impl_->store.shape(impl_->store.require(id)); }

std::vector<BodyState> World::states() const {
  std::vector<BodyState> result;
  states(&result);
  return result;
}

void World::states(std::vector<BodyState>* states) const {
  constexpr std::size_t kStatesPerTask = 4096;
  const BodyStore& store = impl_->bodies_with_states();
  const std::span<const BodyId> ids = bodies();
  states->resize(ids.size());
  const std::lock_guard lock(impl_->fetching);  // the pool runs one loop at a time
  parallel_for(impl_->pool.get(), ids.size(), kStatesPerTask,
               [&](std::size_t first, std::size_t last) {
                 for (std::size_t i = first; i < last; ++i) {
                   (*states)[i] = store.state(ids[i].index);
                 }
               });
}

BodyState World::state(BodyId id) const {
  return impl_->bodies_with_states().state(impl_->store.require(id));
}

void World::set_state(BodyId id, const BodyState& state) {
  const std::uint32_t body = impl_->store.require(id);
  const std::string found = find_fault(state);
  if (!found.empty()) throw InvalidArgument("state: " + found);
  impl_->wake_neighbors(id);
  impl_->edited_body(body, {.sets_state = true, .wakes = true}).set_state(body, state);
  impl_->note_change();
}

bool World::awake(BodyId id) const {
  return impl_->bodies().moving.awake[impl_->store.require(id)] != 0;
}

void World::wake(BodyId id) { impl_->wake(impl_->store.require(id)); }

Real World::mass(BodyId id) const { return impl_->store.mass(impl_->store.require(id)); }

Mat3 World::inverse_inertia(BodyId id) const {
  return impl_->bodies().moving.inverse_inertia[impl_->store.require(id)];
}

void World::apply_force(BodyId id, const Vec3& force) {
  const std::uint32_t body = impl_->store.require(id);
  require_in_range("force", force, kFinite);
  impl_->edited_body(body, {.wakes = true}).apply_force(body, force);
}

void World::apply_force_at_point(BodyId id, const Vec3& force, const Vec3& point) {
  const std::uint32_t body = impl_->store.require(id);
  require_in_range("force", force, kFinite);
  require_in_range("point", point, kFinite);
  const Vec3 arm = point - impl_->position(body);
  BodyStore& store = impl_->edited_body(body, {.wakes = true});
  store.apply_force(body, force);
  store.apply_torque(body, cross(arm, force));
}

void World::apply_torque(BodyId id, const Vec3& torque) {
  const std::uint32_t body = impl_->store.require(id);
  require_in_range("torque", torque, kFinite);
  impl_->edited_body(body, {.wakes = true}).apply_torque(body, torque);
}

void World::apply_impulse(BodyId id, const Vec3& impulse) {
  const std::uint32_t body = impl_->store.require(id);
  require_in_range("impulse", impulse, kFinite);
  impl_->apply_impulse(body, impulse, {});
}

void World::apply_impulse_at_point(BodyId id, const Vec3& impulse, const Vec3& point) {
  const std::uint32_t body = impl_->store.require(id);
  require_in_range("impulse", impulse, kFinite);
  require_in_range("point", point, kFinite);
  const Vec3 arm = point - impl_->bodies_with_states().moving.position[body];
  impl_->apply_impulse(body, impulse, cross(arm, impulse));
}

void World::apply_angular_impulse(BodyId id, const Vec3& impulse) {
  const std::uint32_t body = impl_->store.require(id);
  require_in_range("impulse", impulse, kFinite);
  impl_->apply_impulse(body, {}, impulse);
}

void World::Impl::apply_impulse(std::uint32_t body, const Vec3& linear, const Vec3& angular) {
  if (!(store.mass(body) > 0)) return;
  BodyState state = bodies_with_states().state(body);
  store.refresh_inertia(body);  // on a GPU, the host has not the inertia of this orientation
  state.velocity += linear * (1 / store.mass(body));
  state.angular_velocity += store.moving.inverse_inertia[body] * angular;
  const std::string found = find_fault(state);
  if (!found.empty()) throw InvalidArgument("state after the impulse: " + found);
  edited_body(body, {.sets_state = true, .wakes = true}).set_velocities(body, state);
  note_change();
}

Vec3 World::last_acceleration(BodyId id) const {
  return impl_->bodies().moving.last_acceleration[impl_->store.require(id)];
}

ForceContext World::force_context() { return {impl_->changed_bodies(), impl_->time()}; }

ForceId World::add_any(std::function<void(ForceContext&)> force) {
  impl_->finish();
  const ForceId id = impl_->forces.add(std::move(force));
  impl_->wake_all();
  return id;
}

std::function<void(ForceContext&)>& World::any_force(ForceId id) {
  impl_->finish();
  std::function<void(ForceContext&)>& force = impl_->forces.at(id);
  impl_->hold_graphs();
  return force;
}

void World::remove_force(ForceId id) {
  impl_->finish();
  impl_->forces.remove(id);
  impl_->wake_all();
}

std::span<const ForceId> World::forces() const { return impl_->forces.ids(); }

ContactGeneratorId World::add_any_generator(std::function<void(ContactContext&)> generator) {
  impl_->finish();
  if (impl_->ranks != nullptr) {
    throw InvalidArgument("a world of several ranks has no contact generators");
  }
  const ContactGeneratorId id = impl_->generators.add(std::move(generator));
  impl_->wake_all();
  return id;
}

std::function<void(ContactContext&)>& World::any_generator(ContactGeneratorId id) {
  return impl_->generators.at(id);
}

void World::remove_contact_generator(ContactGeneratorId id) {
  impl_->generators.remove(id);
  impl_->wake_all();
}

std::span<const ContactGeneratorId> World::contact_generators() const {
  return impl_->generators.ids();
}

std::uint64_t World::steps() const {
  impl_->finish();
  return impl_->steps;
}

double World::time() const {
  impl_->finish();
  return impl_->time();
}

std::span<const Contact> World::contacts() const {
  impl_->finish();
  if (!impl_->contacts.shows_list) return {};
  return impl_->contact_list().contacts;
}

std::span<const ContactEvent> World::contact_events() const {
  impl_->finish();
  if (!impl_->contacts.shows_events) return {};
  const ContactList &before = impl_->contact_list_before(), &now = impl_->contact_list();
  return impl_->contacts.events.between(std::span(before.contacts).first(before.detected),
                                        std::span(now.contacts).first(now.detected));
}

std::span<const HitEvent> World::hit_events() const {
  impl_->finish();
  if (!impl_->contacts.shows_events || !impl_->has_hit_events()) return {};
  return impl_->hit_events();
}

std::span<const ContactForce> World::contact_forces() const {
  impl_->finish();
  if (!impl_->contacts.shows_list || !impl_->contacts.has_forces) return {};
  return impl_->contact_forces();
}

std::uint64_t World::state_hash() const { return jfpx::state_hash(states()); }

const Scene& World::settings() const { return impl_->scene; }

}  // namespace JFPX_ABI
}  // namespace jfpx
