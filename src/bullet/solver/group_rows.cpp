/// Setup of the rows of a group for the sweeps on the CPU.
#include "src/bullet/chunks.hpp"
#include "src/bullet/prefetch.hpp"
#include "src/bullet/solver/constraint_solver_impl.hpp"
#include "src/bullet/solver/friction_directions.hpp"
#include "src/bullet/solver/rolling_friction_rows.hpp"
#include "src/bullet/solver/row_inputs.hpp"

#include <LinearMath/btQuickprof.h>

#include <algorithm>
#include <iterator>

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {

void ConstraintSolver::Impl::set_up_rows() {
  BT_PROFILE("solveGroupCacheFriendlySetup");
  {
    BT_PROFILE("schedule contacts");
    solver.schedule(scan.pairs(), directions());
  }
  set_up_contacts();
  if (scan.any_rolling()) set_up_rolling_frictions();
}

void ConstraintSolver::Impl::set_up_contacts() {
  BT_PROFILE("set up contacts");
  in_chunks(pool(), solver.blocks(), kBlocksPerChunk, [&](std::size_t first, std::size_t last) {
    for (auto block = static_cast<std::uint32_t>(first); block < last; ++block) {
      if (block + 1 < last) prefetch_block(block + 1);
      set_up_block(block);
    }
  });
}

void ConstraintSolver::Impl::prefetch_block(std::uint32_t block) const {
  for (std::size_t lane = 0; lane < solver.lanes(); ++lane) {
    const std::uint32_t contact = solver.contacts_of(block)[lane];
    if (contact == cpu::RowSolver::kNoContact) return;
    prefetch_bytes(&scan.contacts()[contact].get(), sizeof(btManifoldPoint));
  }
}

void ConstraintSolver::Impl::set_up_block(std::uint32_t block) {
  const std::size_t lanes = solver.lanes();
  // Not on the stack: that of the caller may have little more than Bullet needs.
  alignas(64) static thread_local Real inputs[rows::kInputFields * rows::kMaxLanes];
  alignas(64) static thread_local Real second[3 * rows::kMaxLanes];
  std::fill_n(inputs, std::size(inputs), Real(0));
  const std::uint32_t* contacts = solver.contacts_of(block);
  std::size_t used = 0;
  for (; used < lanes && contacts[used] != cpu::RowSolver::kNoContact; ++used) {
    const btManifoldPoint& point = scan.contacts()[contacts[used]].get();
    pack_contact(point, *info, lanes, inputs + used);
    if (point.m_appliedImpulse != 0) warm.store(settings.warm_start, std::memory_order_relaxed);
  }
  const cpu::RowSolver::BlockIds ids = solver.ids_of(block);
  const unsigned has_second = solver.set_up_contacts(settings, block, ids, inputs, second);
  Real* const one = solver.friction_rows(block);
  Real* const two = directions() == 2 ? solver.friction_rows(block, 1) : nullptr;
  for (std::size_t lane = 0; lane < used; ++lane) {
    const Real* other = (has_second >> lane & 1) != 0 ? second + lane : nullptr;
    set_friction_directions(scan.contacts()[contacts[lane]], settings, lanes, other, one + lane,
                            two != nullptr ? two + lane : nullptr);
  }
  for (std::uint32_t k = 0; k < directions(); ++k) {
    solver.set_up_frictions(settings, block, ids, k, inputs);
  }
}

void ConstraintSolver::Impl::set_up_rolling_frictions() {
  BT_PROFILE("set up rolling frictions");
  const auto contact_in = [&](std::uint32_t block, std::size_t lane) -> const ContactRef* {
    const std::uint32_t contact = solver.contacts_of(block)[lane];
    return contact == cpu::RowSolver::kNoContact ? nullptr : &scan.contacts()[contact];
  };
  solver.select_rolling_frictions([&](std::uint32_t block) {
    for (std::size_t lane = 0; lane < solver.lanes(); ++lane) {
      const ContactRef* contact = contact_in(block, lane);
      if (contact != nullptr && contact->rolling) return true;
    }
    return false;
  });
  pool().run(solver.rolling_friction_blocks().size(), [&](std::size_t k) {
    const std::uint32_t block = solver.rolling_friction_blocks()[k];
    for (std::uint32_t t = 0; t < cpu::kRollingFrictionRows; ++t) {
      std::fill_n(solver.rolling_friction_rows(k, t), solver.lanes() * rows::kFrictionFields,
                  Real(0));
    }
    for (std::size_t lane = 0; lane < solver.lanes(); ++lane) {
      const ContactRef* contact = contact_in(block, lane);
      if (contact == nullptr || !contact->rolling) continue;
      set_up_rolling_friction(*contact, solver.rolling_friction_rows(k, 0) + lane, solver.lanes());
    }
  });
}

void ConstraintSolver::Impl::set_up_rolling_friction(const ContactRef& contact, Real* to,
                                                     std::size_t lanes) {
  const int fixed = self.m_tmpSolverBodyPool.size() - 1;  // see set_up()
  bullet::set_up_rolling_frictions(self, fixed, settings.relaxation, contact, to, lanes);
}

}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
