/// Setup of the rows of a group for the sweeps on the CPU.
#include "src/bullet/chunks.hpp"
#include "src/bullet/prefetch.hpp"
#include "src/bullet/solver/constraint_solver_impl.hpp"
#include "src/bullet/solver/friction_directions.hpp"
#include "src/bullet/solver/rolling_friction_rows.hpp"
#include "src/bullet/solver/row_inputs.hpp"

#include <algorithm>
#include <iterator>

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {

void ConstraintSolver::Impl::set_up_rows() {
  const Zone zone(*this, "solveGroupCacheFriendlySetup");
  {
    const Zone schedule(*this, "schedule contacts");
    solver.schedule(scan.pairs(), directions());
  }
  if (scan.any_rolling()) {
    solver.select_rolling_frictions(
        [&](std::uint32_t block) { return has_rolling_friction(block); });
  }
  set_up_contacts();
}

void ConstraintSolver::Impl::set_up_contacts() {
  const Zone zone(*this, "set up contacts");
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
  if (has_rolling_friction(block)) {
    set_up_rolling_frictions(block, ids, inputs + rows::kInNormal * lanes);
  }
}

bool ConstraintSolver::Impl::has_rolling_friction(std::uint32_t block) const {
  if (!scan.any_rolling()) return false;
  const std::uint32_t* const contacts = solver.contacts_of(block);
  return std::any_of(contacts, contacts + solver.lanes(), [&](std::uint32_t contact) {
    return contact != cpu::RowSolver::kNoContact && scan.contacts()[contact].rolling;
  });
}

/// @param normals 3 fields
void ConstraintSolver::Impl::set_up_rolling_frictions(std::uint32_t block,
                                                      const cpu::RowSolver::BlockIds& ids,
                                                      const Real* normals) {
  const std::size_t lanes = solver.lanes();
  const std::uint32_t* const contacts = solver.contacts_of(block);
  Real* const rows = solver.rolling_friction_rows(block);
  std::fill_n(rows, solver.rolling_numbers(), Real(0));
  const auto for_each_contact = [&](const auto& f) {
    for (std::size_t lane = 0; lane < lanes && contacts[lane] != cpu::RowSolver::kNoContact; ++lane)
      f(scan.contacts()[contacts[lane]], rows + lane);
  };
  for_each_contact([&](const ContactRef& contact, Real* to) {
    if (contact.rolling) pack_rolling_friction(contact.get(), lanes, to);
  });
  solver.set_up_rolling_axes(block, normals);
  for_each_contact([&](const ContactRef& contact, Real* to) {
    if (contact.anisotropic_rolling) scale_rolling_axes(contact, lanes, to);
  });
  solver.set_up_rolling_frictions(block, ids);
}

}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
