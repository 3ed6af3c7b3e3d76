/// Enqueued steps of a World on a device.
///
/// The device counts completed steps. A step cannot be completed if a list is too short, a body
/// leaves the world or a force must wake a body. This step and all later ones then have no effect.
/// The host performs these steps, one by one, when it needs the state.
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
  if (has_changes() || queue.deferred_steps > 0 || !queue.failure.empty()) finish();
  open_queue();
  queue.deferred_steps = count;
  try {
    launch(stream);
  } catch (const DeviceError& error) {
    queue.failure = error.what();
  } catch (const OutOfMemory& error) {
    queue.failure = error.what();
  } catch (...) {
    queue.deferred_steps = 0;
    throw;
  }
  if (queue.deferred_steps > 0) finish();
}

/// Enqueues the deferred steps on the device, up to the first that needs the host.
void World::Impl::launch(cuda::Stream stream) {
  if (device == nullptr || (!is_launched() && !has_graph() && is_at_rest())) return;
  device->wait_for(stream);
  if (!generators.ids().empty()) return;
  enter_device();
  flush_edits();
  if (!force_table.update(forces, store)) return;
  queue.state.store(StepQueue::State::launched, std::memory_order_release);
  device->enqueue(forces.empty() ? nullptr : &force_table, steps, stream, &queue.deferred_steps);
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
  open_queue();
}

void World::Impl::finish_queue() {
  using State = StepQueue::State;
  const std::lock_guard lock(queue.finishing);
  const State state = queue.state.load(std::memory_order_relaxed);
  if (state == State::empty || state == State::finishing) return;
  struct Scope {
    Scope(Impl* impl, State state) : w(impl), after(state) {
      w->queue.state.store(State::finishing, std::memory_order_relaxed);
    }
    ~Scope() {
      const std::lock_guard device_lock(w->fetching);
      const bool is_open = w->queue.deferred_steps > 0 || w->has_graph();
      if (after != State::launched) after = is_open ? State::open : State::empty;
      w->queue.state.store(after, std::memory_order_release);
    }
    Impl* w;
    State after;
  } scope(this, state);
  {
    const std::lock_guard device_lock(fetching);  // other const functions may be fetching
    if (state == State::launched || has_graph()) finish_launched();
  }
  if (!queue.failure.empty()) {
    if (resident()) leave_device();
    lose_device(queue.failure);
    queue.report.device_failure = std::exchange(queue.failure, {});
    queue.report.step = steps;
  }
  scope.after = State::open;
  make_deferred_steps();
}

/// Waits for the device, and records its completed steps.
void World::Impl::finish_launched() {
  DeviceWorld::Finished done;
  try {
    done = device->finish();
  } catch (const DeviceError& error) {
    queue.failure = error.what();
    done = device->finish();
  }
  spent_us = 0;
  queue.deferred_steps += done.deferred;
  if (done.completed == 0) return;
  contacts.begin_step();
  complete_on_device(done.completed);
  steps += done.completed;
  contacts.complete_step();
  query_tree.invalidate();
  if (done.completed > 1 || done.deferred > 0) steps_at_rest = 0;  // unknown
  if (done.deferred > 0) return;
  StepReport report;
  report.step = steps;
  fill_report(done.last, &report);
  report_backend(&report);
  note_rest(report);
  keep_report(std::move(report));
}

/// Keeps the first device failure until finish_steps() returns it.
void World::Impl::keep_report(StepReport report) {
  if (report.device_failure.empty()) std::swap(report.device_failure, queue.report.device_failure);
  queue.report = std::move(report);
}

void World::Impl::make_deferred_steps() {
  for (; queue.deferred_steps > 0; --queue.deferred_steps) {
    try {
      keep_report(make_step());
    } catch (...) {
      queue.deferred_steps = 0;
      throw;
    }
  }
}

void World::Impl::drop_queue() noexcept {
  if (is_launched() || has_graph()) {
    try {
      device->finish();
    } catch (...) {  // the lost state of the device is about to be replaced
    }
  }
  if (is_launched()) queue.state.store(StepQueue::State::open, std::memory_order_release);
  queue.deferred_steps = 0;
  queue.failure.clear();
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
  const bool waits_for_nothing = w.queue.state != StepQueue::State::empty && !w.has_changes();
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
  StepReport report = w.queue.report;
  w.queue.report.device_failure.clear();
  return report;
}

}  // namespace cuda
}  // namespace JFPX_ABI
}  // namespace jfpx
