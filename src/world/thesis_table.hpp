/// Table of the functions that the library jfpx_thesis provides to a World.
#pragma once

#include "src/world/contacts/broad_phase_search.hpp"
#include "src/world/impl_access.hpp"

#include <memory>

namespace jfpx {
inline namespace JFPX_ABI {

/// Performs the steps of one world with Solver::worst_first.
class WorstFirstStep {
 public:
  virtual ~WorstFirstStep() = default;
  /// Runs all stages, like World::Impl::advance().
  virtual bool advance(WorldAccess::Impl* world, StepReport* report) = 0;
};

struct ThesisTable {
  std::unique_ptr<WorstFirstStep> (*make_step)(const Scene& scene);
  /// For BroadPhase::hierarchy and brute_force.
  std::unique_ptr<BroadPhaseSearch> (*make_broad_phase)(std::unique_ptr<SphereCollider> collider,
                                                        BroadPhase broad_phase);
};

/// Called by thesis::enable(). May run concurrently with any function. @param table outlives all
/// worlds
JFPX_API void set_thesis_table(const ThesisTable* table) noexcept;

/// Null unless the scene has Solver::worst_first.
/// @throws InvalidArgument, as make_broad_phase(), if the library is required and not enabled
std::unique_ptr<WorstFirstStep> make_worst_first_step(const Scene& scene);
/// @throws InvalidArgument also if `broad_phase` is not a value of the enumeration
std::unique_ptr<BroadPhaseSearch> make_broad_phase(std::unique_ptr<SphereCollider> collider,
                                                   BroadPhase broad_phase);

}  // namespace JFPX_ABI
}  // namespace jfpx
