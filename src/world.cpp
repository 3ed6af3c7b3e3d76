/// The step: forces, integrate, detect, wake, resolve (thesis 4.3). Read this file first.
#include <jfpx/error.hpp>
#include <jfpx/world.hpp>

#include "src/body_store.hpp"
#include "src/contact_resolver.hpp"
#include "src/force_registry.hpp"
#include "src/narrow_phase.hpp"
#include "src/scene_validate.hpp"

#include <chrono>
#include <new>
#include <optional>
#include <utility>

namespace jfpx::inline JFPX_ABI {
namespace {

using Clock = std::chrono::steady_clock;

double elapsed_ms(Clock::time_point since, Clock::time_point until) {
  return std::chrono::duration<double, std::milli>(until - since).count();
}

/// Rounded up: the body in the scene, in the store, in the copy that a step can go back to.
constexpr std::size_t kBytesPerBody = 1024;

/// What this engine asks of a body beyond what every scene must be.
void require_native(const BodyDef& def, std::uint64_t body) {
  if (def.mass > 0 && std::holds_alternative<HalfSpace>(def.shape)) {
    throw InvalidScene("body " + std::to_string(body) + ": mass is " + to_text(def.mass) +
                       "; it must be 0 for a half-space, which fills half of the world");
  }
}

void require_finite(const char* name, const Vec3& value) {
  if (is_finite(value)) return;
  throw InvalidArgument(std::string(name) + " is " + to_text(value) + "; it must be finite");
}

/// What touches an awake body wakes, and so on along the contacts; the surroundings, never awake,
/// wake nobody (thesis 4.4.6, matchAwakeState). A sweep each way by turns: the contacts are sorted,
/// so one sweep carries the news along all rising chains.
void wake_along(std::span<const Contact> contacts, BodyStore* bodies) {
  const std::vector<std::uint8_t>& awake = bodies->moving.awake;
  const auto pass_on = [&](const Contact& c) {
    if (awake[c.a] == awake[c.b] || !bodies->movable(c.a) || !bodies->movable(c.b)) return false;
    const bool a_awake = awake[c.a] != 0;
    bodies->wake_by_touch(a_awake ? c.b : c.a, a_awake ? c.a : c.b);
    return true;
  };
  for (bool changed = true; changed;) {
    changed = false;
    for (std::size_t i = 0; i < contacts.size(); ++i) changed |= pass_on(contacts[i]);
    if (!changed) return;
    for (std::size_t i = contacts.size(); i-- > 0;) changed |= pass_on(contacts[i]);
  }
}

/// The first body whose state is not finite or has left the world.
std::optional<BodyId> find_runaway(const BodyStore& bodies) {
  const MotionArrays& moving = bodies.moving;
  for (const BodyId id : bodies.ids()) {
    const Vec3& x = moving.position[id.index];
    const bool in_world = absolute(x.x) <= kMaxCoordinate && absolute(x.y) <= kMaxCoordinate &&
                          absolute(x.z) <= kMaxCoordinate;
    if (!in_world || !is_finite(moving.orientation[id.index]) ||
        !is_finite(moving.velocity[id.index]) || !is_finite(moving.angular_velocity[id.index])) {
      return id;
    }
  }
  return std::nullopt;
}

}  // namespace

struct World::Impl {
  Impl(const Scene& given, std::unique_ptr<SphereCollider> collider)
      : scene(given), bodies(given.dt, given.sleep), narrow_phase(std::move(collider)) {
    for (std::size_t i = 0; i < given.bodies.size(); ++i) {
      require_native(given.bodies[i], i);
      bodies.add(given.bodies[i]);
    }
  }

  /// Who rested on a body that goes away or is put elsewhere must notice.
  void wake_neighbours(std::uint32_t body) {
    for (const Contact& c : contacts) {
      if (c.a == body) bodies.wake(c.b);
      if (c.b == body) bodies.wake(c.a);
    }
  }

  /// A force that comes or goes is news to all bodies, whichever it may act on.
  void wake_all() {
    for (const BodyId id : bodies.ids()) bodies.wake(id.index);
  }

  double time() const { return static_cast<double>(steps) * static_cast<double>(scene.dt); }

  bool advance(StepReport* report);
  void undo() noexcept {
    std::swap(bodies.moving, before);
    contacts.clear();
  }

  Scene scene;
  BodyStore bodies;
  NarrowPhase narrow_phase;
  ContactResolver resolver;
  ForceRegistry forces;
  bool bodies_changed = true;     ///< since the narrow phase last heard of them
  std::vector<Contact> contacts;  ///< of the last step
  MotionArrays before;            ///< the state that a failed step goes back to
  std::uint64_t steps = 0;
};

/// False when a body left the finite numbers; the report says which.
bool World::Impl::advance(StepReport* report) {
  const auto all_finite = [&] {
    const std::optional<BodyId> runaway = find_runaway(bodies);
    report->non_finite = runaway.has_value();
    if (runaway) report->non_finite_body = *runaway;
    return !runaway;
  };
  const Clock::time_point start = Clock::now();
  ForceContext context(bodies, time());
  forces.apply(context);
  bodies.integrate();
  if (!all_finite()) return false;

  const Clock::time_point integrated = Clock::now();
  if (bodies_changed) narrow_phase.set_bodies(bodies);
  bodies_changed = false;
  contacts.clear();
  report->sphere_contacts = narrow_phase.find_contacts(bodies, &contacts);
  report->contacts = contacts.size();

  const Clock::time_point detected = Clock::now();
  wake_along(contacts, &bodies);
  const ResolverReport resolved = resolver.resolve(bodies, contacts, scene.resolver);
  report->position_iterations = resolved.position_iterations;
  report->velocity_iterations = resolved.velocity_iterations;
  report->iterations_exhausted = resolved.exhausted;

  const Clock::time_point end = Clock::now();
  report->integrate_ms = elapsed_ms(start, integrated);
  report->detect_ms = elapsed_ms(integrated, detected);
  report->resolve_ms = elapsed_ms(detected, end);
  return all_finite();
}

StepReport World::step() {
  Impl& w = *impl_;
  StepReport report;
  const Clock::time_point start = Clock::now();
  try {
    w.before = w.bodies.moving;
  } catch (const std::bad_alloc&) {
    throw OutOfMemory("no memory to keep the state of " + std::to_string(w.bodies.ids().size()) +
                      " bodies during a step");
  }
  try {
    if (w.advance(&report)) {
      ++w.steps;
    } else {
      w.undo();
    }
  } catch (const std::bad_alloc&) {
    const std::size_t needed = (w.contacts.size() + 1) * sizeof(Contact);
    w.undo();
    throw OutOfMemory("no memory for the contacts of a step: more than " + std::to_string(needed) +
                      " bytes are needed");
  } catch (...) {
    w.undo();
    throw;
  }
  report.step = w.steps;
  report.backend = w.narrow_phase.backend();
  for (const BodyId id : w.bodies.ids()) report.awake += w.bodies.moving.awake[id.index];
  report.total_ms = elapsed_ms(start, Clock::now());
  return report;
}

World::World(const Scene& scene, const WorldSettings& settings)
    : World(scene, make_sphere_collider(settings.collider)) {}

World::World(const Scene& scene, std::unique_ptr<SphereCollider> collider) {
  if (collider == nullptr) throw InvalidArgument("collider is null; it must be a sphere collider");
  validate(scene);
  try {
    impl_ = std::make_unique<Impl>(scene, std::move(collider));
  } catch (const std::bad_alloc&) {
    throw OutOfMemory("no memory for a world of " + std::to_string(scene.bodies.size()) +
                      " bodies: about " + std::to_string(scene.bodies.size() * kBytesPerBody) +
                      " bytes are needed");
  }
}

World::~World() = default;
World::World(World&&) noexcept = default;
World& World::operator=(World&&) noexcept = default;

BodyId World::add(const BodyDef& body) {
  const std::uint64_t number = impl_->bodies.ids().size();
  validate_body_count(number + 1);
  validate_body(body, number);
  require_native(body, number);
  impl_->bodies_changed = true;
  impl_->contacts.clear();
  return impl_->bodies.add(body);
}

void World::remove(BodyId id) {
  impl_->wake_neighbours(impl_->bodies.require(id));
  impl_->bodies.remove(id);
  impl_->contacts.clear();
  impl_->bodies_changed = true;
}

std::span<const BodyId> World::bodies() const { return impl_->bodies.ids(); }

std::vector<BodyState> World::states() const {
  std::vector<BodyState> states;
  states.reserve(bodies().size());
  for (const BodyId id : bodies()) states.push_back(impl_->bodies.state(id.index));
  return states;
}

BodyState World::state(BodyId id) const { return impl_->bodies.state(impl_->bodies.require(id)); }

void World::set_state(BodyId id, const BodyState& state) {
  const std::uint32_t body = impl_->bodies.require(id);
  const std::string found = find_fault(state);
  if (!found.empty()) throw InvalidArgument("state: " + found);
  impl_->wake_neighbours(body);
  impl_->bodies.set_state(body, state);
  impl_->bodies_changed = true;
}

bool World::awake(BodyId id) const {
  return impl_->bodies.moving.awake[impl_->bodies.require(id)] != 0;
}

void World::apply_force(BodyId id, const Vec3& force) {
  const std::uint32_t body = impl_->bodies.require(id);
  require_finite("force", force);
  impl_->bodies.apply_force(body, force);
}

void World::apply_force_at_point(BodyId id, const Vec3& force, const Vec3& point) {
  const std::uint32_t body = impl_->bodies.require(id);
  require_finite("force", force);
  require_finite("point", point);
  impl_->bodies.apply_force(body, force);
  impl_->bodies.apply_torque(body, cross(point - impl_->bodies.moving.position[body], force));
}

void World::apply_torque(BodyId id, const Vec3& torque) {
  const std::uint32_t body = impl_->bodies.require(id);
  require_finite("torque", torque);
  impl_->bodies.apply_torque(body, torque);
}

Vec3 World::last_acceleration(BodyId id) const {
  return impl_->bodies.moving.last_acceleration[impl_->bodies.require(id)];
}

ForceContext World::force_context() { return {impl_->bodies, impl_->time()}; }

ForceId World::add_any(std::function<void(ForceContext&)> force) {
  const ForceId id = impl_->forces.add(std::move(force));
  impl_->wake_all();
  return id;
}

std::function<void(ForceContext&)>& World::any_force(ForceId id) { return impl_->forces.at(id); }

void World::remove_force(ForceId id) {
  impl_->forces.remove(id);
  impl_->wake_all();
}

std::span<const ForceId> World::forces() const { return impl_->forces.ids(); }

double World::time() const { return impl_->time(); }

std::span<const Contact> World::contacts() const { return impl_->contacts; }

std::uint64_t World::state_hash() const { return jfpx::state_hash(states()); }

const Scene& World::scene() const { return impl_->scene; }

}  // namespace jfpx::inline JFPX_ABI
