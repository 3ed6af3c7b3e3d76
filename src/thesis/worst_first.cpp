/// The step of Solver::worst_first, and the table of functions for World.
#include <jfpx/thesis/worst_first.hpp>

#include "src/base/stopwatch.hpp"
#include "src/thesis/broad_phases.hpp"
#include "src/thesis/contact_resolver.hpp"
#include "src/thesis/contact_search.hpp"
#include "src/thesis/free_motion.hpp"
#include "src/thesis/wake_propagation.hpp"
#include "src/world/thesis_table.hpp"
#include "src/world/world_impl.hpp"

#include <algorithm>
#include <functional>
#include <iterator>
#include <optional>
#include <utility>

namespace jfpx {
inline namespace JFPX_ABI {
namespace thesis {
namespace {

/// The first body for which is_in_world() is false.
std::optional<BodyId> find_runaway(const BodyStore& store) {
  for (const BodyId id : store.ids()) {
    if (!is_in_world(store.state(id.index))) return id;
  }
  return std::nullopt;
}

class WorstFirst final : public WorstFirstStep {
 public:
  explicit WorstFirst(const Scene& scene) : motion_(scene.dt, scene.sleep) {}
  bool advance(WorldAccess::Impl* world, StepReport* report) override;

 private:
  void find_contacts(WorldAccess::Impl* world, StepReport* report);
  std::span<const Contact> contacts_to_resolve(WorldAccess::Impl* world);

  FreeMotion motion_;
  ContactSearch search_;
  WakePropagation propagate_waking_;
  ContactResolver resolver_;
  std::vector<Contact> resolved_;  ///< without contacts of sensors; used in a world with sensors
};

/// Integration, then detection, then resolution (thesis 4.3).
bool WorstFirst::advance(WorldAccess::Impl* world, StepReport* report) {
  Stopwatch watch;
  BodyStore& store = world->store;
  ForceContext context(store, world->time());
  world->forces.call(context);
  motion_.integrate(&store);
  if (!world->all_finite(find_runaway(store), report)) return false;

  const double integrate_ms = watch.lap_ms();
  find_contacts(world, report);

  const double detect_ms = watch.lap_ms();
  const std::span<const Contact> active = contacts_to_resolve(world);
  propagate_waking_(active, &store);
  const ResolverReport resolution =
      resolver_.resolve(store, active, world->scene.resolver, report->generated_contacts);
  report->position_iterations = resolution.position_iterations;
  report->velocity_iterations = resolution.velocity_iterations;
  report->iterations_exhausted = resolution.exhausted;
  if (!world->all_finite(find_runaway(store), report)) return false;
  report->integrate_ms = integrate_ms;
  report->detect_ms = detect_ms;
  report->resolve_ms = watch.lap_ms();
  return true;
}

/// Detects the contacts at the current poses and calls the contact generators.
void WorstFirst::find_contacts(WorldAccess::Impl* world, StepReport* report) {
  world->start_detection();
  world->contacts.last.get([&](ContactList* list) {
    const BodyStore& store = world->store;
    list->contacts.clear();
    std::size_t spheres = search_.find_contacts(store, &world->contact_finder, &list->contacts);
    list->detected = list->contacts.size();
    set_materials(BodiesOfStep(store), world->scene.materials, world->pool.get(), &list->contacts);
    world->contacts.changes.start(&list->contacts, list->detected);
    world->call_generators(&list->contacts, report);
    world->contacts.changes.apply(&spheres);
    list->detected = list->contacts.size() - report->generated_contacts;
    report->sphere_contacts = spheres;
    report->contacts = list->detected;
  });
  world->finish_detection(report);
}

/// The contacts that wake bodies and are resolved: all except those of sensors, in the same order.
std::span<const Contact> WorstFirst::contacts_to_resolve(WorldAccess::Impl* world) {
  const std::vector<Contact>& all = world->contact_list().contacts;
  if (!world->store.has_sensors()) return all;
  resolved_.clear();
  std::ranges::copy_if(all, std::back_inserter(resolved_), std::logical_not(), &Contact::sensor);
  return resolved_;
}

std::unique_ptr<WorstFirstStep> make_step(const Scene& scene) {
  return std::make_unique<WorstFirst>(scene);
}

std::unique_ptr<BroadPhaseSearch> make_broad_phase(std::unique_ptr<SphereCollider> collider,
                                                   BroadPhase broad_phase) {
  if (broad_phase == BroadPhase::hierarchy) {
    return std::make_unique<HierarchySearch>(std::move(collider));
  }
  return std::make_unique<EveryPairSearch>(std::move(collider));
}

constexpr ThesisTable kTable{make_step, make_broad_phase};

}  // namespace

void enable() noexcept { set_thesis_table(&kTable); }

}  // namespace thesis
}  // namespace JFPX_ABI
}  // namespace jfpx
