/// Steps of a World on a device, and what the host fetches of them.
#include <jfpx/cuda/world.hpp>
#include <jfpx/error.hpp>

#include "src/world/world_impl.hpp"

#include <mutex>

namespace jfpx {
inline namespace JFPX_ABI {

void World::Impl::enter_device() {
  if (resident) return;
  if (bodies_changed) contact_finder.set_bodies(store);
  bodies_changed = false;
  device->upload(store, &contact_finder.sub_shapes(), &soft_step.last_contacts());
  resident = true;
  motion_is_current = contacts_are_current = contacts_before_are_current = true;
  contact_set_is_current = true;
}

void World::Impl::fetch_motion() {
  const std::lock_guard lock(fetching);
  if (motion_is_current) return;
  device->fetch_motion(&store.moving);
  motion_is_current = true;
}

void World::Impl::fetch_contacts() {
  if (!resident) return;
  const std::lock_guard lock(fetching);
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
  }
  if (!is_saved) save_for_undo();
  return false;
}

/// @returns false if the step is to be done on the host, which reports what is wrong
bool World::Impl::step_on_device(StepReport* report) {
  enter_device();
  if (!forces.ids().empty()) {
    fetch_motion();
    ForceContext context(store, time());
    forces.call(context);
    device->upload_forces(store);
  }
  const DeviceWorld::Result result = device->step();
  if (result.invalid_bounds) return false;
  report->non_finite = result.runaway.has_value();
  if (result.runaway) {
    report->non_finite_body = store.id(*result.runaway);
    return true;
  }
  std::swap(contacts, contacts_before);
  detected_count_before = detected_count;
  contacts_before_are_current = contacts_are_current;
  motion_is_current = contacts_are_current = contact_set_is_current = false;
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
    throw BackendUnavailable(w.device_failure.empty()
                                 ? "cuda: this world has no device; it needs Backend::cuda and "
                                   "Solver::soft_step"
                                 : "cuda: the device of this world has failed: " +
                                       w.device_failure);
  }
  w.enter_device();
  return w.device->states();
}

}  // namespace cuda
}  // namespace JFPX_ABI
}  // namespace jfpx
