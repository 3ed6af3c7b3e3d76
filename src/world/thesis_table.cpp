/// Selection between built-in functions and those of jfpx_thesis.
#include "src/world/thesis_table.hpp"

#include <jfpx/error.hpp>

#include <atomic>
#include <string>
#include <utility>

namespace jfpx {
inline namespace JFPX_ABI {
namespace {

std::atomic<const ThesisTable*> enabled_table{nullptr};

/// @param setting name of the setting that requires the library
const ThesisTable& require_thesis(const char* setting) {
  if (const ThesisTable* table = enabled_table.load(std::memory_order_acquire)) return *table;
  throw InvalidArgument(std::string(setting) +
                        ", which requires the library jfpx_thesis: link it, and call "
                        "jfpx::thesis::enable() of jfpx/thesis/worst_first.hpp first");
}

}  // namespace

void set_thesis_table(const ThesisTable* table) noexcept {
  enabled_table.store(table, std::memory_order_release);
}

std::unique_ptr<WorstFirstStep> make_worst_first_step(const Scene& scene) {
  if (scene.solver != Solver::worst_first) return nullptr;
  return require_thesis("scene.solver is worst_first").make_step(scene);
}

std::unique_ptr<BroadPhaseSearch> make_broad_phase(std::unique_ptr<SphereCollider> collider,
                                                   BroadPhase broad_phase) {
  switch (broad_phase) {
    case BroadPhase::cells:
      return std::make_unique<CellSearch>(std::move(collider));
    case BroadPhase::hierarchy:
    case BroadPhase::brute_force:
      return require_thesis("broad_phase is hierarchy or brute_force")
          .make_broad_phase(std::move(collider), broad_phase);
  }
  throw InvalidArgument("broad_phase is " + std::to_string(static_cast<int>(broad_phase)) +
                        "; it must be cells, hierarchy or brute_force");
}

}  // namespace JFPX_ABI
}  // namespace jfpx
