/// Properties of the bodies of a World that can be changed between two steps.
#include <jfpx/error.hpp>

#include "src/scene/scene_validate.hpp"
#include "src/world/world_impl.hpp"

#include <optional>
#include <string>

namespace jfpx {
inline namespace JFPX_ABI {
namespace {

/// @param fault the message, or an empty string for a valid value
void require_valid(const std::string& fault) {
  if (!fault.empty()) throw InvalidArgument(fault);
}

}  // namespace

Mat3 World::inertia(BodyId id) const { return impl_->store.inertia(impl_->store.require(id)); }

void World::set_mass(BodyId id, Real mass) {
  BodyStore& bodies = impl_->store;
  const std::uint32_t body = bodies.require(id);
  require_valid(find_mass_fault(mass));
  if (bodies.movable(body) != (mass > 0)) {
    throw InvalidArgument(
        "mass is " + to_text(mass) + "; it must be " +
        (bodies.movable(body) ? "> 0 for a movable body" : "0 for an immovable or kinematic body"));
  }
  if (bodies.mass(body) == mass) return;
  if (!bodies.inertia_given(body)) require_valid(find_inertia_fault(bodies.shape(body), mass));
  impl_->edited_body(body, {.sets_mass = true, .wakes = true}).set_mass(body, mass);
  bodies.wake(body);
}

void World::set_inertia(BodyId id, const std::optional<Mat3>& inertia) {
  BodyStore& bodies = impl_->store;
  const std::uint32_t body = bodies.require(id);
  if (inertia) require_valid(find_inertia_fault(*inertia));
  if (!bodies.movable(body)) return;
  if (!inertia) require_valid(find_inertia_fault(bodies.shape(body), bodies.mass(body)));
  impl_->edited_body(body, {.sets_mass = true, .wakes = true}).set_inertia(body, inertia);
  bodies.wake(body);
}

MotionLocks World::motion_locks(BodyId id) const {
  return impl_->store.motion_locks(impl_->store.require(id));
}

void World::set_motion_locks(BodyId id, const MotionLocks& locks) {
  BodyStore& bodies = impl_->store;
  const std::uint32_t body = bodies.require(id);
  require_valid(find_locks_fault(locks, impl_->scene.solver));
  if (bodies.immovable(body) || bodies.motion_locks(body) == locks) return;
  const BodyState state = impl_->bodies_with_states().state(body);
  impl_->edited_body(body, {.sets_state = true, .sets_mass = true, .wakes = true})
      .set_motion_locks(body, locks);
  if (bodies.movable(body)) {
    bodies.refresh_inertia(body);
    bodies.set_velocities(body, state);
  }
  impl_->note_change();
}

Real World::friction(BodyId id) const { return impl_->store.friction(impl_->store.require(id)); }

void World::set_friction(BodyId id, Real friction) {
  const std::uint32_t body = impl_->store.require(id);
  require_valid(find_range_fault(&BodyDef::friction, friction));
  if (impl_->store.friction(body) == friction) return;
  impl_->edited_body_in_lists(body, {}).set_friction(body, friction);
  impl_->wake_with_neighbors(id);
}

Real World::restitution(BodyId id) const {
  return impl_->store.restitution(impl_->store.require(id));
}

void World::set_restitution(BodyId id, Real restitution) {
  const std::uint32_t body = impl_->store.require(id);
  require_valid(find_range_fault(&BodyDef::restitution, restitution));
  impl_->edited_body_in_lists(body, {}).set_restitution(body, restitution);
}

Vec3 World::acceleration(BodyId id) const {
  return impl_->store.acceleration(impl_->store.require(id));
}

void World::set_acceleration(BodyId id, const Vec3& acceleration) {
  const std::uint32_t body = impl_->store.require(id);
  require_valid(find_range_fault(&BodyDef::acceleration, acceleration));
  if (impl_->store.acceleration(body) == acceleration) return;
  impl_->edited_body(body, {.wakes = true}).set_acceleration(body, acceleration);
  impl_->store.wake(body);
}

Real World::linear_damping(BodyId id) const {
  return impl_->store.linear_damping(impl_->store.require(id));
}

Real World::angular_damping(BodyId id) const {
  return impl_->store.angular_damping(impl_->store.require(id));
}

void World::set_damping(BodyId id, Real linear, Real angular) {
  const std::uint32_t body = impl_->store.require(id);
  require_valid(find_range_fault(&BodyDef::linear_damping, linear));
  require_valid(find_range_fault(&BodyDef::angular_damping, angular));
  impl_->edited_body(body, {}).set_damping(body, linear, angular);
}

std::uint64_t World::user_data(BodyId id) const {
  return impl_->store.user_data(impl_->store.require(id));
}

void World::set_user_data(BodyId id, std::uint64_t user_data) {
  impl_->store.set_user_data(impl_->store.require(id), user_data);
}

bool World::sensor(BodyId id) const { return impl_->store.sensor(impl_->store.require(id)); }

CollisionFilter World::filter(BodyId id) const {
  return impl_->store.filter(impl_->store.require(id));
}

void World::set_filter(BodyId id, const CollisionFilter& filter) {
  const std::uint32_t body = impl_->store.require(id);
  if (impl_->store.filter(body) == filter) return;
  impl_->edited_body_in_lists(body, {}).set_filter(body, filter);
  impl_->wake_with_neighbors(id);
}

bool World::pair_ignored(BodyId a, BodyId b) const {
  return impl_->store.pair_ignored({impl_->store.require(a), impl_->store.require(b)});
}

void World::set_pair_ignored(BodyId a, BodyId b, bool ignored) {
  const BodyPair pair{impl_->store.require(a), impl_->store.require(b)};
  if (a == b) {
    throw InvalidArgument("pair is (" + std::to_string(a.index) + ", " + std::to_string(b.index) +
                          "); it must be of two different bodies");
  }
  if (impl_->store.pair_ignored(pair) == ignored) return;
  impl_->edited_body_in_lists(pair.a, {.sets_pairs = true});
  impl_->edited_body_in_lists(pair.b, {}).set_pair_ignored(pair, ignored);
  impl_->wake_with_neighbors(a);
  impl_->wake_with_neighbors(b);
}

}  // namespace JFPX_ABI
}  // namespace jfpx
