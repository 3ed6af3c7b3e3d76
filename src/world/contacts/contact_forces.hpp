/// The list of World::contact_forces(), built on demand from the contacts of the solver.
#pragma once

#include <jfpx/world.hpp>

#include "src/base/thread_pool.hpp"
#include "src/contact_solver/soft_step/contact_set.hpp"
#include "src/world/bodies/body_store.hpp"

#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {

/// Lists the points that push, in the order of the contacts.
/// @param contacts  after the step, with its impulses
/// @param inverse_h [1/s], of a substep
/// @param bodies    with the ids and radii of the step
/// @throws std::bad_alloc
void make_contact_forces(const soft_step::ContactView& contacts, Real inverse_h,
                         const BodyStore& bodies, ThreadPool* pool,
                         std::vector<ContactForce>* forces);

}  // namespace JFPX_ABI
}  // namespace jfpx
