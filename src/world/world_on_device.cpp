/// Steps of a World on a device, and copies of their results to the host.
#include <jfpx/cuda/world.hpp>
#include <jfpx/error.hpp>

#include "src/base/stopwatch.hpp"
#include "src/world/contacts/contact_forces.hpp"
#include "src/world/contacts/hit_events.hpp"
#include "src/world/world_impl.hpp"

#include <mutex>
#include <utility>

namespace jfpx {
inline namespace JFPX_ABI {

namespace {

using Motion = HostMirror::Motion;

/// Adds the duration of a scope to `us`, also when an exception leaves the scope.
class ScopedTimer {
 public:
  explicit ScopedTimer(double* us) : us_(us) {}
  ~ScopedTimer() { *us_ += watch_.lap_us(); }
  ScopedTimer(const ScopedTimer&) = delete;
  ScopedTimer& operator=(const ScopedTimer&) = delete;

 private:
  double* us_;
  Stopwatch watch_;
};

}  // namespace

std::unique_ptr<DeviceWorld> World::Impl::warmed(std::unique_ptr<DeviceWorld> device) {
  Scene scene;
  scene.bodies.resize(2);
  scene.bodies[1].shape = Box{};
  World world(scene, {.collider = {.backend = Backend::cpu}});
  world.impl_->device = std::move(device);
  const StepReport report = world.step();
  if (!report.device_failure.empty()) throw DeviceError(report.device_failure);
  world.impl_->mirror.leave();
  return std::move(world.impl_->device);
}

/// Selects the backend of the next step. Backend::automatic selects anew for each step.
void World::Impl::choose_device(StepReport* report) {
  steps_on_device = false;
  const double last_us = std::exchange(spent_us, 0);
  if (scene.solver != Solver::soft_step || !generators.ids().empty()) return;
  if (automatic != nullptr) {
    if (last_us > 0) automatic->record(last_us);
    if (device == nullptr) {
      std::string failure;
      device = automatic->take_started(&failure);
      if (device != nullptr) device->configure(scene);
      if (!failure.empty()) report->device_failure = device_failure = failure;
    }
    if (!automatic->choose(store.size())) return;
  }
  steps_on_device = device != nullptr;
}

void World::Impl::enter_device() {
  if (resident()) return;
  make_contact_lists();
  const ScopedTimer timer(&spent_us);
  if (bodies_changed) contact_finder.set_bodies(store);
  bodies_changed = false;
  force_table.invalidate();
  store.make_inertia_arrays();  // bodies of any kind may be added and edited on the device
  device->upload(store, &contact_finder.sub_shapes(), &soft_step.last_contacts(), has_hit_events());
  note_forces();
  mirror.enter();
  flush_joints();
}

BodyStore& World::Impl::edited_body(std::uint32_t body, const BodyEdit& edit) {
  begin_edit();
  if (!resident()) return store;
  BodyEdit& all = mirror.edits[body];
  all.sets_state |= edit.sets_state;
  all.sets_mass |= edit.sets_mass;
  all.sets_pairs |= edit.sets_pairs;
  all.wakes |= edit.wakes;
  all.wakes_neighbors |= edit.wakes_neighbors;
  if (edit.wakes_neighbors) mirror.invalidate_other_motion();
  if (edit.sets_mass) {  // the device computes the inertia in world axes
    mirror.invalidate_other_motion();
    force_table.invalidate();
  }
  return store;
}

BodyStore& World::Impl::edited_body_in_lists(std::uint32_t body, const BodyEdit& edit) {
  finish();
  if (resident()) {
    remember_listed(body);
  } else {
    make_contact_lists();
  }
  return edited_body(body, edit);
}

void World::Impl::remember_listed(std::uint32_t body) {
  const ListedBody shown = listed(store, body);
  mirror.changed_before.try_emplace(body, shown);
  mirror.changed.try_emplace(body, shown);
}

BodyId World::Impl::add(const BodyDef& def) {
  begin_edit();
  const std::uint32_t body = store.next_index();
  if (resident() && !device->has_room(std::size_t{body} + 1)) leave_device();
  if (!resident()) return store.add(def);
  // All operations that may throw precede the change of the store.
  BodyEdits& edits = mirror.edits;
  BodyEdits added{{body, {.is_added = true}}};
  if (edits.size() + 1 >= edits.bucket_count()) edits.reserve(2 * edits.size() + 16);
  const BodyId id = store.add(def);
  edits.insert(added.extract(body));  // no effect if the slot of a removed body has an edit
  edits.find(body)->second.is_added = true;
  force_table.invalidate();
  return id;
}

void World::Impl::remove(BodyId id) {
  begin_edit();
  const std::uint32_t body = id.index;
  if (!resident()) {
    make_contact_lists();
    wake_neighbors(id);
    remove_joints_of(body);
    store.remove(id);
    soft_step.forget(body);
    return;
  }
  // All operations that may throw precede the change of the store.
  soft_step.reserve(store.capacity());
  remember_listed(body);
  if (mirror.has_contact_set) wake_neighbors(id);
  mirror.edits[body];
  remove_joints_of(body);
  mirror.edits[body] = {.wakes_neighbors = true, .is_removed = true};
  mirror.invalidate_other_motion();
  store.remove(id);
  soft_step.forget(body);
  force_table.invalidate();
}

void World::Impl::replace(BodyId id, const BodyDef& def) {
  const std::uint32_t body = id.index;
  if (!(def.mass > 0) && store.movable(body)) require_other_movable(body);
  begin_edit();
  if (resident()) leave_device();
  BodyStore::Replacement prepared = store.prepare(body, def);
  soft_step.reserve(store.capacity());
  make_contact_lists();
  wake_neighbors(id);
  // From here on, nothing throws.
  store.replace(body, def, std::move(prepared));
  soft_step.forget(body);
  if (store.movable(body)) return;
  // As the next step would do; a snapshot has no color for them.
  joints.for_each_of(
      body, [this](std::uint32_t joint) { joints.last()[joint].color = soft_step::kFixedColor; });
}

void World::Impl::note_forces() {
  mirror.forced_bodies.clear();
  for (const BodyId id : store.ids()) mirror.forced_bodies.push_back(id.index);
}

void World::Impl::flush_edits() {
  flush_joints();
  BodyEdits& edits = mirror.edits;
  if (edits.empty()) return;
  const ScopedTimer timer(&spent_us);
  std::vector<std::uint32_t>& forced_bodies = mirror.forced_bodies;
  forced_bodies.reserve(forced_bodies.size() + edits.size());
  device->edit(store, edits);
  for (const auto& [body, edit] : edits) {
    if (store.lives(body)) forced_bodies.push_back(body);
  }
  edits.clear();
}

Vec3 World::Impl::position(std::uint32_t body) {
  finish();
  collect();
  if (!resident() || mirror.motion >= Motion::states) return store.moving.position[body];
  const auto edit = mirror.edits.find(body);
  if (edit != mirror.edits.end() && (edit->second.sets_state || edit->second.is_added))
    return store.moving.position[body];
  return device->fetch_position(body);
}

void World::Impl::fetch_motion() {
  const std::lock_guard lock(fetching);
  if (mirror.motion == Motion::all) return;
  flush_edits();
  const ScopedTimer timer(&spent_us);
  // Current states are not overwritten, because other threads may be reading them.
  if (mirror.motion == Motion::stale) device->fetch_states(&store.moving, pool.get());
  device->fetch_other_motion(&store.moving, pool.get());
  mirror.motion = Motion::all;
}

void World::Impl::fetch_states() {
  const std::lock_guard lock(fetching);
  if (mirror.motion >= Motion::states) return;
  flush_edits();
  const ScopedTimer timer(&spent_us);
  device->fetch_states(&store.moving, pool.get());
  mirror.motion = Motion::states;
}

void World::Impl::make_list(bool of_step_before, ContactList* list) {
  collect_contacts(of_step_before);
  const std::lock_guard lock(fetching);
  const ScopedTimer timer(&spent_us);
  DetectedContacts* found = of_step_before ? &contacts.detected_before : &contacts.detected;
  soft_step::ContactSet fetched;
  const BodiesOfStep bodies(store, of_step_before ? &mirror.changed_before : &mirror.changed);
  if (resident()) device->fetch_contacts(bodies, of_step_before, &fetched, found);
  const soft_step::ContactView set = resident()       ? fetched.view()
                                     : of_step_before ? soft_step.contacts_before()
                                                      : soft_step.last_contacts().view();
  contacts.maker.make(*found, set, true, bodies, scene.materials, list);
}

void World::Impl::collect_contacts(bool of_step_before) {
  if (ranks == nullptr) return;
  if (of_step_before) {
    ranks->gather_before(&soft_step.set_before(), &contacts.detected_before);
  } else {
    ranks->gather_last(&soft_step.last_contacts(), &contacts.detected);
  }
}

const ContactList& World::Impl::contact_list() {
  return contacts.last.get([this](ContactList* list) { make_list(false, list); });
}

const ContactList& World::Impl::contact_list_before() {
  if (contacts.state == StepContacts::State::repeated) return contact_list();
  return contacts.before.get([this](ContactList* list) { make_list(true, list); });
}

const std::vector<ContactForce>& World::Impl::contact_forces() {
  return contacts.forces.get([this](std::vector<ContactForce>* list) {
    if (resident()) fetch_contact_set();
    collect_contacts(false);
    make_contact_forces(soft_step.last_contacts().view(), soft_step.inverse_h(), store, pool.get(),
                        list);
  });
}

const std::vector<HitEvent>& World::Impl::hit_events() {
  return contacts.hits.get([this](std::vector<HitEvent>* hits) {
    collect_contacts(false);
    const std::lock_guard lock(fetching);
    const ScopedTimer timer(&spent_us);
    soft_step::ContactSet fetched;
    const BodiesOfStep bodies(store, &mirror.changed);
    if (resident()) device->fetch_contacts(bodies, false, &fetched, &contacts.detected);
    find_hits(contacts.detected, resident() ? fetched.view() : soft_step.last_contacts().view(),
              bodies, hit_speed, pool.get(), hits);
  });
}

void World::Impl::make_contact_lists() {
  contact_list();
  if (!contacts.shows_events) return;
  contact_list_before();
  if (has_hit_events()) hit_events();
}

void World::Impl::fetch_contact_set() {
  const std::lock_guard lock(fetching);
  if (mirror.has_contact_set) return;
  soft_step.reserve(store.capacity());
  const ScopedTimer timer(&spent_us);
  soft_step::ContactSet last;
  device->fetch_contact_set(&last);
  soft_step.replace_last_contacts(std::move(last));
  mirror.has_contact_set = true;
}

void World::Impl::fetch_all() {
  finish();
  make_contact_lists();
  collect();
  collect_contacts(false);
  if (resident()) {
    fetch_motion();
    fetch_contact_set();
    fetch_joints();
  }
  const std::lock_guard lock(fetching);
  soft_step.drop_removed();
}

void World::Impl::leave_device() {
  fetch_all();
  mirror.leave();
}

/// Performs one step on the device. If the device fails, fetches the state and performs all later
/// steps on the CPU.
/// @returns false if the host must perform the step
bool World::Impl::advance_on_device(StepReport* report) {
  try {
    if (step_on_device(report)) return true;
  } catch (const DeviceError& error) {
    report->device_failure = error.what();
  } catch (const OutOfMemory& error) {
    report->device_failure = error.what();
  }
  if (resident()) {
    if (is_saved) undo_motion();  // the host applies the forces of this step again
    leave_device();
  }
  if (!report->device_failure.empty()) lose_device(report->device_failure);
  if (!is_saved) save_for_undo();
  return false;
}

/// Calls the forces on the host and copies their sums to the device.
void World::Impl::apply_forces_on_host() {
  fetch_motion();
  save_for_undo();
  ForceContext context(store, time());
  forces.call(context);
  device->upload_forces(store);
  note_forces();
}

/// @returns false if the host must perform the step and report the error
bool World::Impl::step_on_device(StepReport* report) {
  enter_device();
  flush_edits();
  const bool are_known = force_table.update(forces, store);
  if (!are_known) apply_forces_on_host();
  const bool act_there = are_known && !forces.empty();
  DeviceWorld::Result result = device->step(act_there ? &force_table : nullptr, steps);
  if (result.must_wake) {
    apply_forces_on_host();
    result = device->step(nullptr, steps);
  }
  if (result.invalid_bounds) return false;
  report->non_finite = result.runaway.has_value();
  if (result.runaway) {
    report->non_finite_body = store.id(*result.runaway);
    if (is_saved) {
      undo_motion();
      device->upload_forces(store);
    }
    return true;
  }
  complete_on_device(1);
  fill_report(result, report);
  return true;
}

/// Records completed steps of the device, and marks the host's copies as outdated.
void World::Impl::complete_on_device(std::uint64_t count) {
  for (const std::uint32_t body : mirror.forced_bodies) {
    store.moving.force[body] = store.moving.torque[body] = {};
  }
  if (count > 1) contacts.last.invalidate();  // the step before the last is one of these steps
  contacts.begin_detection();
  soft_step.forget_none();
  mirror.complete_steps(count, !joints.empty());
}

void World::Impl::fill_report(const DeviceWorld::Result& result, StepReport* report) {
  report->integrate_ms = result.forces_ms;
  report->detect_ms = result.detect_ms;
  report->resolve_ms = result.resolve_ms;
  report->contacts = result.contacts;
  report->sphere_contacts = result.sphere_contacts;
  report->awake = result.awake;
}

/// Performs all later steps on the CPU.
void World::Impl::lose_device(const std::string& failure) {
  device_failure = failure;
  device.reset();
  if (automatic != nullptr) automatic->give_up();
}

}  // namespace JFPX_ABI
}  // namespace jfpx
