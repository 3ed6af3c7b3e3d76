/// The step of a world: forces, integration, detection, waking, resolution (thesis 4.3).
#include <jfpx/error.hpp>

#include "src/world/world_impl.hpp"

#include <algorithm>
#include <chrono>
#include <functional>
#include <iterator>
#include <new>
#include <optional>
#include <utility>

namespace jfpx {
inline namespace JFPX_ABI {
namespace {

using Clock = std::chrono::steady_clock;

double elapsed_ms(Clock::time_point since, Clock::time_point until) {
  return std::chrono::duration<double, std::milli>(until - since).count();
}

/// Upper estimate of the memory per body: in the scene, in the body store and in the copy that
/// undo() restores. Used in an error message only.
constexpr std::size_t kBytesPerBody = 1280;

void combine_materials(const BodyStore& bodies, const MaterialSettings& rules,
                       std::vector<Contact>* contacts) {
  for (Contact& c : *contacts) {
    const std::uint32_t a = c.a.index, b = c.b.index;
    c.friction = combined(rules.friction, bodies.friction(a), bodies.friction(b));
    c.restitution = combined(rules.restitution, bodies.restitution(a), bodies.restitution(b));
  }
}

void mark_sensors(const BodyStore& bodies, std::vector<Contact>* contacts) {
  if (!bodies.has_sensors()) return;
  for (Contact& c : *contacts) c.sensor = bodies.sensor(c.a.index) || bodies.sensor(c.b.index);
}

/// The first body whose state is not finite or that has a coordinate above kMaxCoordinate.
std::optional<BodyId> find_runaway(const BodyStore& bodies) {
  const MotionArrays& moving = bodies.moving;
  for (const BodyId id : bodies.ids()) {
    const Vec3& x = moving.position[id.index];
    const bool in_world = absolute(x.x) <= kMaxCoordinate && absolute(x.y) <= kMaxCoordinate &&
                          absolute(x.z) <= kMaxCoordinate;
    // If the square of the angular velocity overflows, normalized() returns a zero quaternion.
    const bool is_rotation = length_squared(moving.orientation[id.index]) > Real(0.5);
    if (!in_world || !is_rotation || !is_finite(moving.orientation[id.index]) ||
        !is_finite(moving.velocity[id.index]) || !is_finite(moving.angular_velocity[id.index])) {
      return id;
    }
  }
  return std::nullopt;
}

}  // namespace

/// The contacts that wake bodies and are resolved: all but those of sensors, in the same order.
std::span<const Contact> World::Impl::contacts_to_resolve() {
  if (!bodies.has_sensors()) return contacts;
  resolved.clear();
  std::ranges::copy_if(contacts, std::back_inserter(resolved), std::logical_not(),
                       &Contact::sensor);
  return resolved;
}

/// Runs all stages of a step. Returns false, with the body in the report, if a state is no longer
/// finite or within kMaxCoordinate; the caller then calls undo(), as after an exception.
bool World::Impl::advance(StepReport* report) {
  const auto all_finite = [&] {
    const std::optional<BodyId> runaway = find_runaway(bodies);
    report->non_finite = runaway.has_value();
    if (runaway) report->non_finite_body = *runaway;
    return !runaway;
  };
  const Clock::time_point start = Clock::now();
  ForceContext context(bodies, time());
  forces.call(context);
  bodies.integrate();
  if (!all_finite()) return false;

  const Clock::time_point integrated = Clock::now();
  if (bodies_changed) contact_finder.set_bodies(bodies);
  bodies_changed = false;
  std::swap(contacts, contacts_before);
  contacts_are_new = true;
  contacts.clear();
  report->sphere_contacts = contact_finder.find_contacts(bodies, &contacts);
  // Copying the string may throw; at this point the step can still be undone.
  report->device_failure = contact_finder.collider().device_failure();
  report->contacts = contacts.size();
  combine_materials(bodies, scene.materials, &contacts);
  mark_sensors(bodies, &contacts);
  ContactContext contact_context(bodies, time(), &contacts);
  generators.call(contact_context);
  report->generated_contacts = contacts.size() - report->contacts;

  const Clock::time_point detected = Clock::now();
  const std::span<const Contact> active = contacts_to_resolve();
  propagate_waking(active, &bodies);
  const ResolverReport resolution =
      resolver.resolve(bodies, active, scene.resolver, report->generated_contacts);
  report->position_iterations = resolution.position_iterations;
  report->velocity_iterations = resolution.velocity_iterations;
  report->iterations_exhausted = resolution.exhausted;

  if (!all_finite()) return false;
  events.update(std::span(contacts).first(report->contacts));

  const Clock::time_point end = Clock::now();
  report->integrate_ms = elapsed_ms(start, integrated);
  report->detect_ms = elapsed_ms(integrated, detected);
  report->resolve_ms = elapsed_ms(detected, end);
  return true;
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
  w.contacts_are_new = false;
  w.query_tree.invalidate();
  try {
    if (w.advance(&report)) {
      ++w.steps;
      w.shows_contacts = true;
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
  const SphereCollider& collider = w.contact_finder.collider();
  report.backend = collider.backend();
  report.algorithm = collider.algorithm();
  report.choice = collider.reason();
  for (const BodyId id : w.bodies.ids()) {
    if (w.bodies.movable(id.index)) report.awake += w.bodies.moving.awake[id.index];
  }
  report.total_ms = elapsed_ms(start, Clock::now());
  return report;
}

World::World(const Scene& scene, const WorldSettings& settings)
    : World(scene, make_sphere_collider(settings.collider), settings.broad_phase) {}

World::World(const Scene& scene, std::unique_ptr<SphereCollider> collider, BroadPhase broad_phase) {
  if (collider == nullptr) throw InvalidArgument("collider is null; it must be a sphere collider");
  validate(scene);
  try {
    impl_ = std::make_unique<Impl>(scene, std::move(collider), broad_phase);
  } catch (const std::bad_alloc&) {
    throw OutOfMemory("no memory for a world of " + std::to_string(scene.bodies.size()) +
                      " bodies: about " + std::to_string(scene.bodies.size() * kBytesPerBody) +
                      " bytes are needed");
  }
}

World::~World() = default;
World::World(World&&) noexcept = default;
World& World::operator=(World&&) noexcept = default;

}  // namespace JFPX_ABI
}  // namespace jfpx
