/// The list of World::hit_events(), computed on demand from the contacts of the solver.
#pragma once

#include <jfpx/world.hpp>

#include "src/base/thread_pool.hpp"
#include "src/contact_solver/soft_step/contact_set.hpp"
#include "src/world/bodies/bodies_of_step.hpp"
#include "src/world/contacts/detected_contacts.hpp"

#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {

/// @param start    positions and velocities at the start of the step
/// @param contacts after the step, with its impulses
/// @param bodies   with the ids and radii of the step
/// @param least    [m/s], of the approach speeds
/// @param hits     receives the events, sorted by (a.index, b.index)
/// @throws std::bad_alloc
void find_hits(const DetectedContacts& start, const soft_step::ContactView& contacts,
               const BodiesOfStep& bodies, Real least, ThreadPool* pool,
               std::vector<HitEvent>* hits);

}  // namespace JFPX_ABI
}  // namespace jfpx
