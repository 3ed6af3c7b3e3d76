/// The step of a world.
#include <jfpx/error.hpp>

#include "src/base/parallel_for.hpp"
#include "src/base/reserve.hpp"
#include "src/base/stopwatch.hpp"
#include "src/scene/scene_validate.hpp"
#include "src/sphere_collider/backend_table.hpp"
#include "src/world/device/division.hpp"
#include "src/world/world_impl.hpp"

#include <algorithm>
#include <functional>
#include <new>
#include <optional>
#include <utility>

namespace jfpx {
inline namespace JFPX_ABI {
namespace {

/// Upper estimate of the memory per body: in the body store and in the copy that undo() restores.
/// Used in an error message only.
constexpr std::size_t kBytesPerBody = 128 * sizeof(Real);

constexpr std::size_t kBodiesPerTask = 4096;

std::string no_memory_for(const char* what, std::size_t bodies) {
  return "no memory for " + std::string(what) + " of " + std::to_string(bodies) +
         " bodies: about " + std::to_string(bodies * kBytesPerBody) + " bytes are needed";
}

/// Parallel version of *copy = array.
template <class Item>
void copy_array(ThreadPool* pool, const std::vector<Item>& array, std::vector<Item>* copy) {
  resize_geometric(copy, array.size());
  parallel_for(pool, array.size(), kBodiesPerTask, [&](std::size_t first, std::size_t last) {
    std::copy_n(array.data() + first, last - first, copy->data() + first);
  });
}

}  // namespace

/// Whether all bodies are in the world. @param runaway the first body that is not
bool World::Impl::all_finite(const std::optional<BodyId>& runaway, StepReport* report) {
  report->non_finite = runaway.has_value();
  if (runaway) report->non_finite_body = *runaway;
  return !runaway;
}

/// Prepares contact detection: the last contacts become those of the step before.
void World::Impl::start_detection() {
  if (bodies_changed) contact_finder.set_bodies(store);
  bodies_changed = false;
  contacts.begin_detection();
}

void World::Impl::finish_detection(StepReport* report) {
  // Copying the string may throw; at this point the step can still be undone.
  report->device_failure = contact_finder.collider().device_failure();
}

/// Detection of Solver::soft_step, and the contact generators.
void World::Impl::find_contacts(StepReport* report) {
  soft_step::ContactSet& set = soft_step.contacts();
  DetectedContacts& found = contacts.detected;
  contact_finder.set_keeps_keys(!generators.ids().empty());
  const std::size_t spheres =
      contact_finder.find_speculative_contacts(store, scene.soft_step.speculative_margin,
                                               pool.get(), soft_step.last_contacts(), &set, &found);
  keep_motion(&found);
  found.generated.clear();
  set.sphere_materials.clear();
  ContactChanges::Ignored ignored;
  if (!generators.ids().empty()) {
    contacts.changes.start(store, scene.materials, pool.get(), &set, &found);
    call_generators(&found.generated, report);
    ignored = contacts.changes.apply();
    if (ignored.any_manifold) contact_finder.note_empty();
  }
  soft_step.ignore(ignored.pairs);
  contact_finder.complete(&set, pool.get());
  if (ranks != nullptr) {
    contact_exchange::share_detected(&ranks->domain(), contact_finder.crossing_spheres(), &set);
  }
  report->sphere_contacts = spheres - ignored.touching_spheres + found.sphere_count;
  report->contacts = spheres - ignored.touching_spheres + found.contacts.size();
}

/// Keeps the motion at the start of the step for lists of contacts.
void World::Impl::keep_motion(DetectedContacts* found) {
  // Immovable bodies change with the owners only.
  const std::uint64_t version = ranks == nullptr ? 0 : ranks->domain().version();
  const bool copies_all = ranks == nullptr || version != found->version;
  found->version = version;
  const auto keep = [&](const auto& column, auto* kept) {
    copies_all ? copy_array(pool.get(), column, kept) : copy_of_rank(column, kept);
  };
  keep(store.moving.position, &found->position);
  if (!has_hit_events()) return;
  keep(store.moving.velocity, &found->velocity);
  keep(store.moving.angular_velocity, &found->angular_velocity);
}

/// Calls the contact generators, which append to a list and use `contacts.changes`.
void World::Impl::call_generators(std::vector<Contact>* list, StepReport* report) {
  const std::size_t count = list->size();
  ContactContext context(store, time(), list, &contacts.changes);
  generators.call(context);
  report->generated_contacts = list->size() - count;
}

/// Number of awake movable bodies, of this rank.
std::uint32_t World::Impl::count_awake() const {
  const std::span<const std::uint32_t> bodies =
      ranks == nullptr ? store.mobile() : ranks->domain().mine();
  return parallel_reduce(
      pool.get(), bodies.size(), kBodiesPerTask, 0u,
      [&](std::size_t first, std::size_t last) {
        std::uint32_t count = 0;
        for (const std::uint32_t i : bodies.subspan(first, last - first)) {
          if (store.movable(i)) count += store.moving.awake[i];
        }
        return count;
      },
      std::plus<>());
}

/// Runs all stages of a step. Returns false, with the body in the report, if a state is no longer
/// finite or exceeds kMaxCoordinate. The caller then calls undo(), as after an exception.
bool World::Impl::advance(StepReport* report) {
  if (steps_on_device && advance_on_device(report)) return !report->non_finite;
  if (resident()) leave_device();
  const std::string failure = report->device_failure;
  const bool completed =
      worst_first == nullptr ? advance_soft_step(report) : worst_first->advance(this, report);
  if (!failure.empty()) report->device_failure = failure;
  return completed;
}

/// Detection, then substeps of integration and contact solving. Until commit(), only arrays that
/// save_for_undo() copies change.
bool World::Impl::advance_soft_step(StepReport* report) {
  Stopwatch watch;
  ForceContext context(store, time());
  forces.call(context);
  const double forces_ms = watch.lap_ms();
  start_detection();
  if (ranks != nullptr) {
    ranks->update_ghosts(&store, joints, scene.soft_step.speculative_margin);
    contact_finder.set_domain(&ranks->domain());
  }
  find_contacts(report);
  finish_detection(report);
  soft_step.add_generated(store, contacts.detected.generated);
  const double detect_ms = watch.lap_ms();
  if (!all_finite(soft_step.solve(&store, joints.view()), report)) return false;
  const BegunCounts begun = count_begun_contacts(
      soft_step.contacts().view(), ranks == nullptr ? nullptr : &ranks->domain(), pool.get());
  report->contacts += begun.spheres + begun.points;
  report->sphere_contacts += begun.spheres;
  soft_step.commit(&store, steps, contact_finder.sub_shapes().view(), contact_finder.fixed_trees(),
                   contact_finder.present());
  joints.commit();
  if (ranks != nullptr) ranks->complete_step();
  report->integrate_ms = forces_ms;
  report->detect_ms = detect_ms;
  report->resolve_ms = watch.lap_ms();
  return true;
}

/// Copies the arrays that a step changes before it can fail. For soft_step, copies forces and
/// torques only if there are callbacks that add to them. Copying all arrays would take longer than
/// some stages of a step on many threads.
void World::Impl::save_for_undo() {
  if (resident()) fetch_motion();
  const MotionArrays& now = store.moving;
  is_saved = true;
  if (scene.solver == Solver::worst_first) {
    before = now;
    return;
  }
  const bool saves_forces = !forces.ids().empty();
  if (!saves_forces) {
    before.force.clear();
    before.torque.clear();
  }
  if (saves_forces) {
    copy_array(pool.get(), now.force, &before.force);
    copy_array(pool.get(), now.torque, &before.torque);
  }
  each_saved([this](const auto& from, auto& to) { copy_of_rank(from, &to); }, now, before);
}

/// copy_array(), with several ranks only of the bodies of this rank. Those of other ranks are not
/// up to date.
template <class Item>
void World::Impl::copy_of_rank(const std::vector<Item>& array, std::vector<Item>* copy) {
  if (ranks == nullptr) return copy_array(pool.get(), array, copy);
  resize_geometric(copy, array.size());
  const std::span<const std::uint32_t> bodies = ranks->domain().mine();
  parallel_for(pool.get(), bodies.size(), kBodiesPerTask, [&](std::size_t first, std::size_t last) {
    for (const std::uint32_t i : bodies.subspan(first, last - first)) {
      (*copy)[i] = array[i];
    }
  });
}

/// Restores the motion that save_for_undo() has copied.
void World::Impl::undo_motion() noexcept {
  MotionArrays& now = store.moving;
  if (scene.solver == Solver::worst_first) {
    std::swap(now, before);
  } else {
    if (!before.force.empty()) {
      std::swap(now.force, before.force);
      std::swap(now.torque, before.torque);
    }
    each_saved(
        [this](auto& array, auto& saved) {
          if (ranks == nullptr) return std::swap(array, saved);
          for (const std::uint32_t i : ranks->domain().mine()) array[i] = saved[i];
        },
        now, before);
  }
  is_saved = false;
}

/// Restores the state before the step, including the contacts that wake_neighbors() uses, and
/// empties World::contacts() and World::contact_events().
void World::Impl::undo() noexcept {
  if (is_saved) undo_motion();
  contacts.undo_step();
  spent_us = 0;
}

/// Counts consecutive steps at whose end all bodies sleep. A report with a failure is not stored,
/// because copying its text may throw.
void World::Impl::note_rest(const StepReport& report) {
  const bool rests = scene.solver == Solver::soft_step && !report.non_finite && report.awake == 0 &&
                     report.device_failure.empty() && !store.has_moving_kinematic_body();
  steps_at_rest = rests ? steps_at_rest + 1 : 0;
  if (rests) last_report = report;
}

StepReport World::step() {
  impl_->finish();
  return impl_->make_step();
}

void World::Impl::report_backend(StepReport* report) const {
  if (resident()) {
    report->backend = Backend::cuda;
    if (automatic != nullptr) report->choice = automatic->reason();
    return;
  }
  const SphereCollider& collider = contact_finder.collider();
  report->backend = collider.backend();
  report->algorithm = collider.algorithm();
  report->choice = device_failure.empty() ? collider.reason() : ChoiceReason::device_failed;
}

/// Precedes save_for_undo(): what a rank receives for new owners is not undone.
void World::Impl::start_step_of_ranks() {
  if (!forces.ids().empty()) collect();
  ranks->start_step(&store, &joints, steps, &soft_step.last_contacts(), &contacts.detected);
}

/// Adds the numbers of all ranks.
void World::Impl::add_ranks(StepReport* report) {
  struct Counts {
    std::uint64_t contacts = 0, sphere_contacts = 0, awake = 0, load = 0;
  };
  const Counts own{report->contacts, report->sphere_contacts, report->awake,
                   WorldRanks::load(report->awake, soft_step.last_contacts())};
  Counts sum;
  std::uint64_t most = 0;
  const std::vector<Counts> all = ranks->domain().gather(own);
  for (const Counts& c : all) {
    sum = {sum.contacts + c.contacts, sum.sphere_contacts + c.sphere_contacts, sum.awake + c.awake,
           sum.load + c.load};
    most = std::max(most, c.load);
  }
  ranks->note_loads(most, sum.load / all.size());
  report->contacts = sum.contacts;
  report->sphere_contacts = sum.sphere_contacts;
  report->awake = static_cast<std::uint32_t>(sum.awake);
}

StepReport World::Impl::make_step() {
  StepReport report;
  Stopwatch watch;
  if (is_at_rest()) {
    report = last_report;
    report.step = ++steps;
    report.integrate_ms = report.detect_ms = report.resolve_ms = 0;
    contacts.repeat_step();
    report.total_ms = watch.lap_ms();
    return report;
  }
  std::optional<ThreadPool::Helpers> helpers;
  try {
    if (ranks != nullptr) start_step_of_ranks();
    choose_device(&report);
    if (!steps_on_device) helpers.emplace(*pool);
    // A step on the device changes nothing on the host, unless the host applies the forces.
    is_saved = false;
    if (!steps_on_device) save_for_undo();
  } catch (const std::bad_alloc&) {
    throw OutOfMemory(no_memory_for("a step", store.size()));
  }
  contacts.begin_step();
  query_tree.invalidate();
  try {
    if (advance(&report)) {
      ++steps;
      contacts.complete_step();
    } else {
      undo();
      report.contacts = report.sphere_contacts = report.generated_contacts = 0;
    }
  } catch (const WorldRanks::OwnersChanged&) {
    undo();
    helpers.reset();
    return make_step();
  } catch (const std::bad_alloc&) {
    undo();
    throw OutOfMemory(no_memory_for("a step", store.size()) + ", and more for their contacts");
  } catch (...) {
    undo();
    throw;
  }
  report.step = steps;
  report_backend(&report);
  if (report.non_finite && resident()) fetch_motion();  // the device reports complete steps only
  if (report.non_finite || !resident()) report.awake = count_awake();
  if (ranks != nullptr) add_ranks(&report);
  report.total_ms = watch.lap_ms();
  spent_us = 1e3 * report.total_ms;
  note_rest(report);
  return report;
}

namespace {

/// @throws InvalidArgument
void check_devices(const Scene& scene, const WorldSettings& settings) {
  if (settings.devices.empty()) return;
  if (settings.devices.size() > device::kMostParts) {
    throw InvalidArgument("devices has " + std::to_string(settings.devices.size()) +
                          " numbers; at most " + std::to_string(device::kMostParts) +
                          " devices share a world");
  }
  std::string devices_are;
  for (const int device : settings.devices) {
    devices_are += (devices_are.empty() ? "devices is {" : ", ") + std::to_string(device);
  }
  devices_are += "}";
  if (settings.collider.backend == Backend::cpu) {
    throw InvalidArgument(devices_are + ", and the backend is cpu; it must be cuda or automatic");
  }
  if (scene.solver != Solver::soft_step) {
    throw InvalidArgument(devices_are + ", and the solver is worst_first; it must be soft_step");
  }
  if (settings.communicator != nullptr && settings.communicator->size() > 1) {
    throw InvalidArgument(devices_are + "; it must be empty for a world of several ranks");
  }
}

}  // namespace

World::World(const Scene& scene, const WorldSettings& settings) {
  const bool has_ranks = settings.communicator != nullptr && settings.communicator->size() > 1;
  if (has_ranks && settings.collider.backend == Backend::cuda) {
    throw InvalidArgument("the backend is cuda; it must be cpu for a world of several ranks");
  }
  if (has_ranks && scene.solver != Solver::soft_step) {
    throw InvalidArgument(
        "the solver is worst_first; it must be soft_step for a world of several ranks");
  }
  if (settings.collider.threads != 1) {
    throw InvalidArgument("collider.threads of a world is " +
                          std::to_string(settings.collider.threads) +
                          "; it must be 1: WorldSettings::threads are those of the whole step");
  }
  if (!(settings.hit_speed > 0)) {
    throw InvalidArgument("hit_speed is " + to_text(settings.hit_speed) +
                          "; it must be > 0; infinity is allowed");
  }
  check_devices(scene, settings);
  auto pool = std::make_unique<ThreadPool>(settings.threads, settings.enqueue_task);
  SphereColliderOptions options = settings.collider;
  std::vector<int> devices = settings.devices;
  if (!devices.empty()) {
    options.backend = Backend::cuda;
    options.device = devices[0];
  } else {
    devices = {options.device};
  }
  if (has_ranks) options.backend = Backend::cpu;
  auto collider = make_sphere_collider(options, pool.get());
  impl_ = Impl::make(scene, std::move(pool), std::move(collider), settings.broad_phase,
                     settings.collider.simd, settings.communicator);
  impl_->hit_speed = settings.hit_speed;
  if (options.backend == Backend::cuda && scene.solver == Solver::soft_step) {
    impl_->device = make_device_world(scene, devices);
  }
  if (options.backend == Backend::automatic && backend_row(Backend::cuda).compiled) {
    impl_->automatic = std::make_unique<AutomaticDevice>(
        settings.collider.costs, [number = settings.collider.device] {
          return Impl::warmed(make_device_world(Scene{}, {number}));
        });
  }
}

World::World(const Scene& scene, std::unique_ptr<SphereCollider> collider, BroadPhase broad_phase,
             unsigned threads) {
  if (collider == nullptr) throw InvalidArgument("collider is null; it must be a sphere collider");
  impl_ = Impl::make(scene, std::make_unique<ThreadPool>(threads), std::move(collider), broad_phase,
                     SimdLevel::automatic);
}

std::unique_ptr<World::Impl> World::Impl::make(const Scene& scene, std::unique_ptr<ThreadPool> pool,
                                               std::unique_ptr<SphereCollider> collider,
                                               BroadPhase broad_phase, SimdLevel simd,
                                               std::shared_ptr<Communicator> communicator) {
  validate(scene);
  try {
    return std::make_unique<Impl>(scene, std::move(pool), std::move(collider), broad_phase, simd,
                                  std::move(communicator));
  } catch (const std::bad_alloc&) {
    throw OutOfMemory(no_memory_for("a world", scene.bodies.size()));
  }
}

World::~World() = default;
World::World(World&&) noexcept = default;
World& World::operator=(World&&) noexcept = default;

}  // namespace JFPX_ABI
}  // namespace jfpx
