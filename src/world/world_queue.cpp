/// Steps of a World on a device that do not wait for the host.
///
/// The device counts the steps that it has completed. A step that it cannot complete, because a
/// list is too short, a body runs away or a force must wake a body, and all steps after it, have no
/// effect. The host makes these steps, one by one, when it needs the state.
#include <jfpx/cuda/world.hpp>
#include <jfpx/error.hpp>

#include "src/world/world_impl.hpp"

#include <mutex>
#include <utility>

namespace jfpx {
inline namespace JFPX_ABI {

void World::Impl::hold_graphs() {
  if (has_graph() && !device->is_held()) device->hold();
}

void World::Impl::send_changes() {
  finish();
  if (device == nullptr) return;
  enter_device();
  flush_edits();
  const bool are_known = force_table.update(forces, store);
  device->prepare(are_known && !forces.empty() ? &force_table : nullptr, steps);
}

void World::Impl::enqueue(std::uint32_t count, cuda::Stream stream) {
  if (count == 0) return;
  if (has_changes() || missing_steps > 0 || !queue_failure.empty()) finish();
  has_queue.store(true, std::memory_order_release);
  missing_steps = count;
  try {
    launch(stream);
  } catch (const DeviceError& error) {
    queue_failure = error.what();
  } catch (const OutOfMemory& error) {
    queue_failure = error.what();
  } catch (...) {
    missing_steps = 0;
    throw;
  }
  if (missing_steps > 0) finish();
}

/// Enqueues the missing steps on the device, as far as it can make them without the host.
void World::Impl::launch(cuda::Stream stream) {
  if (device == nullptr || (!is_launched && !has_graph() && is_at_rest())) return;
  device->wait_for(stream);
  if (!generators.ids().empty()) return;
  enter_device();
  flush_edits();
  if (!force_table.update(forces, store)) return;
  is_launched = true;
  device->enqueue(forces.empty() ? nullptr : &force_table, steps, stream, &missing_steps);
}

void World::Impl::capture(std::uint32_t count, cuda::Stream stream) {
  if (!generators.ids().empty()) {
    throw InvalidArgument(
        "stream is being captured; the world must then have no contact generators, which run on "
        "the host");
  }
  if (has_changes()) {
    throw InvalidArgument(
        "stream is being captured; the world must then have no changes since its last step, or "
        "device_states() must have sent them to the device before the capture");
  }
  if (!force_table.update(forces, store)) {
    throw InvalidArgument(
        "stream is being captured; the world must then have no user-defined forces, which run on "
        "the host");
  }
  const ForceTable* table = forces.empty() ? nullptr : &force_table;
  if (!device->capture(table, steps, count, stream)) {
    throw InvalidArgument(
        "stream is being captured; the world must then have made a step on the device since it "
        "moved there, and device_states() must have been called before the capture");
  }
  has_queue.store(true, std::memory_order_release);
}

void World::Impl::finish_queue() {
  const std::lock_guard lock(finishing);
  if (is_finishing || !has_queue.load(std::memory_order_relaxed)) return;
  struct Scope {
    explicit Scope(Impl* impl) : w(impl) { w->is_finishing = true; }
    ~Scope() {
      w->is_finishing = false;
      const std::lock_guard lock(w->fetching);
      const bool is_open = w->is_launched || w->missing_steps > 0 || w->has_graph();
      w->has_queue.store(is_open, std::memory_order_release);
    }
    Impl* w;
  } const scope(this);
  {
    const std::lock_guard device_lock(fetching);  // other const functions may be fetching
    if (is_launched || has_graph()) finish_launched();
  }
  if (!queue_failure.empty()) {
    if (resident) leave_device();
    lose_device(queue_failure);
    queue_report.device_failure = std::exchange(queue_failure, {});
    queue_report.step = steps;
  }
  is_launched = false;
  make_missing_steps();
}

/// Waits for the device, and records what it has completed.
void World::Impl::finish_launched() {
  DeviceWorld::Finished done;
  try {
    done = device->finish();
  } catch (const DeviceError& error) {
    queue_failure = error.what();
    done = device->finish();
  }
  spent_us = 0;
  missing_steps += done.missing;
  if (done.completed == 0) return;
  complete_on_device(done.completed);
  steps += done.completed;
  contacts_are_new = repeats_contacts = false;
  shows_contacts = shows_events = true;
  query_tree.invalidate();
  events.invalidate();
  contacts_by_body.invalidate();
  if (done.completed > 1 || done.missing > 0) steps_at_rest = 0;  // unknown
  if (done.missing > 0) return;
  StepReport report;
  report.step = steps;
  fill_report(done.last, &report);
  report_backend(&report);
  note_rest(report);
  keep_report(std::move(report));
}

/// Keeps the first failure of a device, until finish_steps() has returned it.
void World::Impl::keep_report(StepReport report) {
  if (report.device_failure.empty()) std::swap(report.device_failure, queue_report.device_failure);
  queue_report = std::move(report);
}

void World::Impl::make_missing_steps() {
  for (; missing_steps > 0; --missing_steps) {
    try {
      keep_report(make_step());
    } catch (...) {
      missing_steps = 0;
      throw;
    }
  }
}

void World::Impl::drop_queue() noexcept {
  if (is_launched || has_graph()) {
    try {
      device->finish();
    } catch (...) {  // the state that the device has lost is about to be replaced
    }
  }
  is_launched = false;
  missing_steps = 0;
  queue_failure.clear();
}

namespace cuda {
namespace {

auto& with_device(World& world) {
  auto& w = WorldAccess::impl(world);
  if (w.scene.solver != Solver::soft_step) {
    throw BackendUnavailable(
        "cuda: this world has the solver worst_first, which runs on the CPU; use soft_step");
  }
  if (w.device != nullptr) return w;
  if (!w.device_failure.empty()) {
    throw BackendUnavailable("cuda: the device of this world has failed: " + w.device_failure);
  }
  throw BackendUnavailable(
      w.automatic != nullptr
          ? R"(cuda: "auto" has not started a GPU for this world; make it with the backend "cuda")"
          : "cuda: this world has no device; make it with the backend \"cuda\" and the solver "
            "soft_step");
}

}  // namespace

DeviceStates device_states(World& world) {
  auto& w = with_device(world);
  const bool waits_for_nothing = w.has_queue.load(std::memory_order_relaxed) && !w.has_changes();
  if (!waits_for_nothing) w.send_changes();
  return with_device(world).device->states();
}

void enqueue_steps(World& world, std::uint32_t count, Stream stream) {
  auto& w = with_device(world);
  w.device->is_capturing(stream) ? w.capture(count, stream) : w.enqueue(count, stream);
}

StepReport finish_steps(World& world) {
  auto& w = WorldAccess::impl(world);
  w.finish();
  StepReport report = w.queue_report;
  w.queue_report.device_failure.clear();
  return report;
}

}  // namespace cuda
}  // namespace JFPX_ABI
}  // namespace jfpx
