/// Running a random world side by side with Bullet's dispatcher and with another one.
#include "tests/bullet/live_random_world.hpp"
#include "tests/bullet/random_world_globals.hpp"

#include <algorithm>
#include <utility>

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {
namespace {

std::string first_log_difference(const std::vector<std::string>& stock,
                                 const std::vector<std::string>& ours) {
  const auto [s, o] = std::mismatch(stock.begin(), stock.end(), ours.begin(), ours.end());
  return "event " + std::to_string(s - stock.begin()) + " is \"" +
         (o == ours.end() ? "missing" : *o) + "\"; stock: \"" +
         (s == stock.end() ? "missing" : *s) + "\"";
}

std::optional<std::string> compare(LiveWorld& stock, LiveWorld& ours, int step) {
  if (const auto difference = first_difference(stock.live().world, ours.live().world,
                                               static_cast<std::uint64_t>(step))) {
    return to_text(*difference);
  }
  if (stock.live().log != ours.live().log) {
    return first_log_difference(stock.live().log, ours.live().log);
  }
  stock.live().log.clear();
  ours.live().log.clear();
  const CollisionDispatcher* dispatcher = ours.live().ours();
  if (dispatcher != nullptr && dispatcher->stats().mismatches > 0) {
    return "verify: " + dispatcher->stats().first_mismatch;
  }
  if (dispatcher != nullptr && !dispatcher->stats().failure.empty()) {
    return "out of memory: " + dispatcher->stats().failure;
  }
  return std::nullopt;
}

void add_totals(const RandomWorld& world, LiveWorld& ours, RunTotals* totals) {
  totals->steps += static_cast<std::uint64_t>(world.steps);
  totals->events += world.events.size();
  const CollisionDispatcher* dispatcher = ours.live().ours();
  if (dispatcher == nullptr) return;
  totals->batches += dispatcher->stats().batches;
  totals->touching += dispatcher->stats().touching;
  totals->written += dispatcher->stats().written;
  totals->convex_pairs += dispatcher->stats().convex_pairs;
  totals->verified += dispatcher->stats().verified;
  totals->sphere_concaves += dispatcher->stats().sphere_concaves;
  totals->concave_pairs += dispatcher->stats().concave_pairs;
  totals->compound_pairs += dispatcher->stats().compound_pairs;
}

}  // namespace

std::unique_ptr<btCollisionDispatcher> make_stock(btCollisionConfiguration* configuration,
                                                  const RandomWorld&) {
  return std::make_unique<btCollisionDispatcher>(configuration);
}

std::unique_ptr<btCollisionDispatcher> make_ours(btCollisionConfiguration* configuration,
                                                 const RandomWorld& world) {
  return std::make_unique<CollisionDispatcher>(
      configuration,
      DispatcherOptions{.collider = {.backend = Backend::cpu, .threads = world.threads},
                        .minimum_batch = world.minimum_batch,
                        .verify = world.verify});
}

std::optional<Failure> run(const RandomWorld& world, RunTotals* totals, MakeDispatcher make) {
  Globals globals(world);
  LiveWorld stock(world, make_stock), ours(world, make);
  LiveWorld* const both[] = {&stock, &ours};
  for (LiveWorld* live : both) live->set_near_callback((world.callbacks & kNear) != 0);
  auto event = world.events.begin();
  for (int step = 0; step < world.steps; ++step) {
    for (; event != world.events.end() && event->step <= step; ++event) {
      if (event->kind == EventKind::callbacks) globals.set_callbacks(event->bits);
      for (LiveWorld* live : both) {
        g_current = &live->live();
        live->apply(*event);
      }
    }
    for (LiveWorld* live : both) {
      g_current = &live->live();
      live->step();
    }
    if (auto what = compare(stock, ours, step + 1)) return Failure{step + 1, std::move(*what)};
  }
  if (totals != nullptr) add_totals(world, ours, totals);
  return std::nullopt;
}

}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
