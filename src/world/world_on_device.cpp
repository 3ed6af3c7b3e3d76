/// Steps of a World on a device, and what the host fetches of them.
#include <jfpx/cuda/world.hpp>
#include <jfpx/error.hpp>

#include "src/world/world_impl.hpp"

#include <chrono>
#include <mutex>
#include <utility>

namespace jfpx {
inline namespace JFPX_ABI {

namespace {

/// Adds its lifetime to a duration.
class Timer {
 public:
  explicit Timer(double* us) : us_(us), start_(Clock::now()) {}
  ~Timer() { *us_ += std::chrono::duration<double, std::micro>(Clock::now() - start_).count(); }
  Timer(const Timer&) = delete;
  Timer& operator=(const Timer&) = delete;

 private:
  using Clock = std::chrono::steady_clock;
  double* us_;
  Clock::time_point start_;
};

}  // namespace

std::unique_ptr<DeviceWorld> World::Impl::make_warm_device(int number) {
  Scene scene;
  scene.bodies.resize(2);
  scene.bodies[1].shape = Box{};
  World world(scene, {.collider = {.backend = Backend::cpu}});
  world.impl_->device = make_device_world(scene, number);
  const StepReport report = world.step();
  if (!report.device_failure.empty()) throw DeviceError(report.device_failure);
  return std::move(world.impl_->device);
}

/// Selects what makes the next step: Backend::automatic decides for each one.
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
    if (!automatic->choose(store.ids().size())) return;
  }
  steps_on_device = device != nullptr;
}

void World::Impl::enter_device() {
  if (resident) return;
  const Timer timer(&spent_us);
  if (bodies_changed) contact_finder.set_bodies(store);
  bodies_changed = false;
  force_table.invalidate();
  device->upload(store, &contact_finder.sub_shapes(), &soft_step.last_contacts());
  resident = true;
  motion_is_current = contacts_are_current = contacts_before_are_current = true;
  contact_set_is_current = true;
}

void World::Impl::fetch_motion() {
  const std::lock_guard lock(fetching);
  if (motion_is_current) return;
  const Timer timer(&spent_us);
  device->fetch_motion(&store.moving);
  motion_is_current = true;
}

void World::Impl::fetch_contacts() {
  if (!resident) return;
  const std::lock_guard lock(fetching);
  const Timer timer(&spent_us);
  if (!contacts_are_current) {
    device->fetch_contacts(store, false, &contacts);
    finish_contacts(&contacts);
    detected_count = contacts.size();
    contacts_are_current = true;
  }
  if (!contacts_before_are_current) {
    device->fetch_contacts(store, true, &contacts_before);
    finish_contacts(&contacts_before);
    detected_count_before = contacts_before.size();
    contacts_before_are_current = true;
  }
}

void World::Impl::fetch_contact_set() {
  const std::lock_guard lock(fetching);
  if (contact_set_is_current) return;
  const Timer timer(&spent_us);
  device->fetch_contact_set(&soft_step.last_contacts());
  contact_set_is_current = true;
}

void World::Impl::fetch_all() {
  if (!resident) return;
  fetch_motion();
  fetch_contacts();
  fetch_contact_set();
}

void World::Impl::leave_device() {
  fetch_all();
  resident = false;
}

/// One step on the device. If it fails, the processor takes over: the state is fetched, and later
/// steps do not use the device.
/// @returns false if the step is to be done on the host
bool World::Impl::advance_on_device(StepReport* report) {
  try {
    if (step_on_device(report)) return true;
  } catch (const DeviceError& error) {
    report->device_failure = error.what();
  } catch (const OutOfMemory& error) {
    report->device_failure = error.what();
  }
  if (resident) {
    if (is_saved) undo_motion();  // the host applies the forces of this step again
    leave_device();
  }
  if (!report->device_failure.empty()) {
    device_failure = report->device_failure;
    device.reset();
    if (automatic != nullptr) automatic->give_up();
  }
  if (!is_saved) save_for_undo();
  return false;
}

/// The host calls the forces, and the device gets their sums.
void World::Impl::apply_forces_on_host() {
  fetch_motion();
  save_for_undo();
  ForceContext context(store, time());
  forces.call(context);
  device->upload_forces(store);
}

/// @returns false if the step is to be done on the host, which reports what is wrong
bool World::Impl::step_on_device(StepReport* report) {
  enter_device();
  const bool are_known = force_table.update(forces, store);
  if (!are_known) apply_forces_on_host();
  const bool act_there = are_known && !forces.empty();
  DeviceWorld::Result result = device->step(act_there ? &force_table : nullptr, time());
  if (result.must_wake) {
    apply_forces_on_host();
    result = device->step(nullptr, time());
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
  std::swap(contacts, contacts_before);
  detected_count_before = detected_count;
  contacts_before_are_current = contacts_are_current;
  motion_is_current = contacts_are_current = contact_set_is_current = false;
  report->integrate_ms = result.forces_ms;
  report->detect_ms = result.detect_ms;
  report->resolve_ms = result.resolve_ms;
  report->contacts = result.contacts;
  report->sphere_contacts = result.sphere_contacts;
  report->awake = result.awake;
  return true;
}

namespace cuda {

DeviceStates device_states(World& world) {
  auto& w = WorldAccess::impl(world);
  if (w.device == nullptr) {
    if (!w.device_failure.empty()) {
      throw BackendUnavailable("cuda: the device of this world has failed: " + w.device_failure);
    }
    throw BackendUnavailable(
        w.automatic != nullptr
            ? "cuda: Backend::automatic has not started a device for this world"
            : "cuda: this world has no device; it needs Backend::cuda and Solver::soft_step");
  }
  w.enter_device();
  return w.device->states();
}

}  // namespace cuda
}  // namespace JFPX_ABI
}  // namespace jfpx
