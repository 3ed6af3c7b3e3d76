/// The step of a world, with either solver.
#include <jfpx/error.hpp>

#include "src/base/parallel_for.hpp"
#include "src/base/reserve.hpp"
#include "src/base/stopwatch.hpp"
#include "src/sphere_collider/backend_table.hpp"
#include "src/world/met_contacts.hpp"
#include "src/world/world_impl.hpp"

#include <algorithm>
#include <atomic>
#include <functional>
#include <iterator>
#include <new>
#include <numeric>
#include <optional>
#include <utility>

namespace jfpx {
inline namespace JFPX_ABI {
namespace {

/// Upper estimate of the memory per body: in the scene, in the body store and in the copy that
/// undo() restores. Used in an error message only.
constexpr std::size_t kBytesPerBody = 1280;

std::string no_memory_for(const char* what, std::size_t bodies) {
  return "no memory for " + std::string(what) + " of " + std::to_string(bodies) +
         " bodies: about " + std::to_string(bodies * kBytesPerBody) + " bytes are needed";
}

/// The first body that is_in_world() refuses.
std::optional<BodyId> find_runaway(const BodyStore& store) {
  for (const BodyId id : store.ids()) {
    if (!is_in_world(store.state(id.index))) return id;
  }
  return std::nullopt;
}

}  // namespace

/// The contacts that wake bodies and are resolved: all but those of sensors, in the same order.
std::span<const Contact> World::Impl::contacts_to_resolve() {
  if (!store.has_sensors()) return contacts;
  resolved.clear();
  std::ranges::copy_if(contacts, std::back_inserter(resolved), std::logical_not(),
                       &Contact::sensor);
  return resolved;
}

/// Whether no body has run away. @param runaway the first one that has
bool World::Impl::all_finite(const std::optional<BodyId>& runaway, StepReport* report) {
  report->non_finite = runaway.has_value();
  if (runaway) report->non_finite_body = *runaway;
  return !runaway;
}

/// Sets the fields of detected contacts that follow from the properties of their bodies.
void World::Impl::finish_contacts(std::vector<Contact>* list) const {
  const MaterialSettings& rules = scene.materials;
  parallel_for(pool.get(), list->size(), 1024, [&](std::size_t first, std::size_t last) {
    for (Contact& c : std::span(*list).subspan(first, last - first)) {
      const std::uint32_t a = c.a.index, b = c.b.index;
      c.friction = combined(rules.friction, store.friction(a), store.friction(b));
      c.restitution = combined(rules.restitution, store.restitution(a), store.restitution(b));
      c.sensor = store.sensor(a) || store.sensor(b);
    }
  });
}

/// Detects the contacts of the current poses and calls the contact generators.
void World::Impl::find_contacts(StepReport* report) {
  if (bodies_changed) contact_finder.set_bodies(store);
  bodies_changed = false;
  std::swap(contacts, contacts_before);
  detected_count_before = detected_count;
  contacts_are_new = true;
  if (scene.solver == Solver::worst_first) contacts.clear();
  report->sphere_contacts =
      scene.solver == Solver::soft_step
          ? contact_finder.find_near_contacts(store, scene.soft_step.speculative_margin, pool.get(),
                                              &soft_step.contacts(), &contacts)
          : contact_finder.find_contacts(store, &contacts);
  // Copying the string may throw; at this point the step can still be undone.
  report->device_failure = contact_finder.collider().device_failure();
  report->contacts = contacts.size();
  finish_contacts(&contacts);
  ContactContext contact_context(store, time(), &contacts);
  generators.call(contact_context);
  report->generated_contacts = contacts.size() - report->contacts;
  detected_count = report->contacts;
}

/// Fills `met` with the contacts that began during the step. Counts them first, so that each thread
/// has its range of the list. @returns the number of contacts of two spheres
std::size_t World::Impl::find_met_contacts() {
  constexpr std::size_t kChunk = 4096;
  const soft_step::ContactView view = soft_step.contacts().view();
  const std::size_t chunks = (view.size() + kChunk - 1) / kChunk;
  resize_geometric(&met_begin, chunks + 1);
  std::atomic<std::size_t> of_spheres{0};
  parallel_for(pool.get(), view.size(), kChunk, [&](std::size_t first, std::size_t last) {
    std::size_t count = 0, spheres = 0;
    for (auto i = static_cast<std::uint32_t>(first); i < last; ++i) {
      const std::uint32_t points = soft_step::count_met(view, i);
      count += points;
      if (view.is_sphere(i)) spheres += points;
    }
    met_begin[first / kChunk] = count;
    of_spheres.fetch_add(spheres, std::memory_order_relaxed);
  });
  met_begin[chunks] = 0;
  std::exclusive_scan(met_begin.begin(), met_begin.end(), met_begin.begin(), std::size_t{0});
  // Room for more than there usually are, so that warm steps allocate nothing.
  reserve_geometric(&met, std::max(met_begin[chunks], std::size_t{64}));
  met.resize(met_begin[chunks]);
  parallel_for(pool.get(), view.size(), kChunk, [&](std::size_t first, std::size_t last) {
    std::size_t next = met_begin[first / kChunk];
    if (next == met_begin[first / kChunk + 1]) return;
    soft_step::for_each_met(
        view, static_cast<std::uint32_t>(first), static_cast<std::uint32_t>(last),
        [this](std::uint32_t body) { return store.moving.position[body]; },
        [this](std::uint32_t body) { return store.radius(body); },
        [&](const soft_step::ContactKey& key, bool, const Vec3& normal, const Vec3& point) {
          met[next++] = {store.id(key.a), store.id(key.b), normal, point, 0};
        });
  });
  return of_spheres;
}

/// Adds the contacts that began during the step to those of detection, after the contacts of
/// the same bodies.
void World::Impl::add_met_contacts(StepReport* report) {
  const std::size_t of_spheres = find_met_contacts();
  if (met.empty()) return;
  finish_contacts(&met);
  // Merges from the back: generated contacts, then others, then those of spheres.
  const auto pair_of = [](const Contact& c) { return std::pair(c.a.index, c.b.index); };
  std::size_t from = contacts.size(), next = met.size();
  resize_geometric(&contacts, from + next);
  std::size_t to = contacts.size();
  while (from > detected_count) contacts[--to] = contacts[--from];
  const std::pair<std::size_t, std::size_t> starts[] = {{report->sphere_contacts, of_spheres},
                                                        {0, 0}};
  for (const auto& [begin, first] : starts) {
    while (next > first || (next > 0 && from > begin)) {
      const bool is_old =
          from > begin && (next == first || pair_of(met[next - 1]) < pair_of(contacts[from - 1]));
      contacts[--to] = is_old ? contacts[--from] : met[--next];
    }
  }
  report->contacts += met.size();
  report->sphere_contacts += of_spheres;
  detected_count = report->contacts;
}

/// Runs all stages of a step. Returns false, with the body in the report, if a state is no longer
/// finite or within kMaxCoordinate; the caller then calls undo(), as after an exception.
bool World::Impl::advance(StepReport* report) {
  if (steps_on_device && advance_on_device(report)) return !report->non_finite;
  if (resident) leave_device();
  const std::string failure = report->device_failure;
  const bool completed =
      scene.solver == Solver::soft_step ? advance_soft_step(report) : advance_worst_first(report);
  if (!failure.empty()) report->device_failure = failure;
  return completed;
}

/// Detection, then integration and contacts in substeps. Until commit(), only arrays that
/// save_for_undo() copies change.
bool World::Impl::advance_soft_step(StepReport* report) {
  Stopwatch watch;
  ForceContext context(store, time());
  forces.call(context);
  const double forces_ms = watch.lap_ms();
  find_contacts(report);
  soft_step.add_generated(store, std::span(contacts).subspan(report->contacts));
  const double detect_ms = watch.lap_ms();
  if (!all_finite(soft_step.solve(&store), report)) return false;
  add_met_contacts(report);
  soft_step.commit(&store);
  report->integrate_ms = forces_ms;
  report->detect_ms = detect_ms;
  report->resolve_ms = watch.lap_ms();
  return true;
}

/// Integration, then detection, then resolution (thesis 4.3).
bool World::Impl::advance_worst_first(StepReport* report) {
  Stopwatch watch;
  ForceContext context(store, time());
  forces.call(context);
  store.integrate();
  if (!all_finite(find_runaway(store), report)) return false;

  const double integrate_ms = watch.lap_ms();
  find_contacts(report);

  const double detect_ms = watch.lap_ms();
  const std::span<const Contact> active = contacts_to_resolve();
  propagate_waking(active, &store);
  const ResolverReport resolution =
      resolver.resolve(store, active, scene.resolver, report->generated_contacts);
  report->position_iterations = resolution.position_iterations;
  report->velocity_iterations = resolution.velocity_iterations;
  report->iterations_exhausted = resolution.exhausted;
  if (!all_finite(find_runaway(store), report)) return false;
  report->integrate_ms = integrate_ms;
  report->detect_ms = detect_ms;
  report->resolve_ms = watch.lap_ms();
  return true;
}

/// Copies the arrays that a step changes before it can fail. Copying all of them would take longer
/// than some stages of a step on many threads.
void World::Impl::save_for_undo() {
  const MotionArrays& now = bodies().moving;
  is_saved = true;
  if (scene.solver == Solver::worst_first) {
    before = now;
    return;
  }
  pool->run(6, [&](std::size_t array) {
    switch (array) {
      case 0:
        return void(before.force = now.force);
      case 1:
        return void(before.torque = now.torque);
      case 2:
        return void(before.last_acceleration = now.last_acceleration);
      case 3:
        return void(before.mean_motion = now.mean_motion);
      case 4:
        return void(before.rest_time = now.rest_time);
      default:
        return void(before.awake = now.awake);
    }
  });
}

/// Restores the motion that save_for_undo() has copied.
void World::Impl::undo_motion() noexcept {
  MotionArrays& now = store.moving;
  if (scene.solver == Solver::worst_first) {
    std::swap(now, before);
  } else {
    std::swap(now.force, before.force);
    std::swap(now.torque, before.torque);
    std::swap(now.last_acceleration, before.last_acceleration);
    std::swap(now.mean_motion, before.mean_motion);
    std::swap(now.rest_time, before.rest_time);
    std::swap(now.awake, before.awake);
  }
  is_saved = false;
}

/// Restores the state before the step, including the contacts that wake_neighbors() uses, and
/// empties World::contacts() and World::contact_events().
void World::Impl::undo() noexcept {
  if (is_saved) undo_motion();
  if (contacts_are_new) {
    std::swap(contacts, contacts_before);
    detected_count = detected_count_before;
  }
  shows_contacts = shows_events = false;
  spent_us = 0;
}

StepReport World::step() {
  Impl& w = *impl_;
  StepReport report;
  Stopwatch watch;
  try {
    w.choose_device(&report);
    // A step on the device changes nothing on the host, unless the host applies the forces.
    w.is_saved = false;
    if (!w.steps_on_device) w.save_for_undo();
  } catch (const std::bad_alloc&) {
    throw OutOfMemory(no_memory_for("a step", w.store.size()));
  }
  w.contacts_are_new = false;
  w.query_tree.invalidate();
  w.events.invalidate();
  w.contacts_by_body.invalidate();
  try {
    if (w.advance(&report)) {
      ++w.steps;
      w.shows_contacts = w.shows_events = true;
    } else {
      w.undo();
    }
  } catch (const std::bad_alloc&) {
    w.undo();
    throw OutOfMemory(no_memory_for("a step", w.store.size()) + ", and more for their contacts");
  } catch (...) {
    w.undo();
    throw;
  }
  report.step = w.steps;
  if (w.resident) {
    report.backend = Backend::cuda;
    if (w.automatic != nullptr) report.choice = w.automatic->reason();
  } else {
    const SphereCollider& collider = w.contact_finder.collider();
    report.backend = collider.backend();
    report.algorithm = collider.algorithm();
    report.choice = w.device_failure.empty() ? collider.reason() : ChoiceReason::device_failed;
    for (const BodyId id : w.store.ids()) {
      if (w.store.movable(id.index)) report.awake += w.store.moving.awake[id.index];
    }
  }
  report.total_ms = watch.lap_ms();
  w.spent_us = 1e3 * report.total_ms;
  return report;
}

World::World(const Scene& scene, const WorldSettings& settings) {
  auto pool = std::make_unique<ThreadPool>(settings.collider.threads);
  auto collider = make_sphere_collider(settings.collider, pool.get());
  impl_ = Impl::make(scene, std::move(pool), std::move(collider), settings.broad_phase);
  if (settings.collider.backend == Backend::cuda && scene.solver == Solver::soft_step) {
    impl_->device = make_device_world(scene, settings.collider.device);
  }
  if (settings.collider.backend == Backend::automatic && backend_row(Backend::cuda).compiled) {
    impl_->automatic = std::make_unique<AutomaticDevice>(
        settings.collider.costs,
        [number = settings.collider.device] { return Impl::make_warm_device(number); });
  }
}

World::World(const Scene& scene, std::unique_ptr<SphereCollider> collider, BroadPhase broad_phase,
             unsigned threads) {
  if (collider == nullptr) throw InvalidArgument("collider is null; it must be a sphere collider");
  impl_ =
      Impl::make(scene, std::make_unique<ThreadPool>(threads), std::move(collider), broad_phase);
}

std::unique_ptr<World::Impl> World::Impl::make(const Scene& scene, std::unique_ptr<ThreadPool> pool,
                                               std::unique_ptr<SphereCollider> collider,
                                               BroadPhase broad_phase) {
  validate(scene);
  try {
    return std::make_unique<Impl>(scene, std::move(pool), std::move(collider), broad_phase);
  } catch (const std::bad_alloc&) {
    throw OutOfMemory(no_memory_for("a world", scene.bodies.size()));
  }
}

World::~World() = default;
World::World(World&&) noexcept = default;
World& World::operator=(World&&) noexcept = default;

}  // namespace JFPX_ABI
}  // namespace jfpx
