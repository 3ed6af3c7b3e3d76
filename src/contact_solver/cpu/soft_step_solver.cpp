/// Rows and sweeps of the soft step on the CPU; see the header.
#include "src/contact_solver/cpu/soft_step_solver.hpp"

#include "src/base/parallel_for.hpp"
#include "src/base/reserve.hpp"
#include "src/contact_solver/row_operations.hpp"

#include <algorithm>
#include <tuple>
#include <type_traits>
#include <utility>

namespace jfpx {
inline namespace JFPX_ABI {
namespace soft_step {
namespace {

constexpr std::size_t kRowsPerChunk = 128, kContactsPerChunk = 4096;

}  // namespace

/// Counting sort of the contacts into rows by kind and group. Rows of a group are in the order of
/// contacts, those with fixed bodies in the order of bodies.
void SoftStepSolver::sort_contacts() {
  count_contacts();
  std::array<std::uint32_t, kGroups> spheres{}, manifolds{};
  std::uint32_t fixed = 0;
  for (Counts& chunk : counts_) {
    for (std::size_t g = 0; g < kGroups; ++g) {
      spheres[g] += std::exchange(chunk.spheres[g], spheres[g]);
      manifolds[g] += std::exchange(chunk.manifolds[g], manifolds[g]);
    }
    fixed += std::exchange(chunk.fixed, fixed);
  }
  const auto start = [](auto* kind_rows, const auto& counts) {
    kind_rows->begin[0] = 0;
    for (std::size_t g = 0; g < kGroups; ++g) {
      kind_rows->begin[g + 1] = kind_rows->begin[g] + counts[g];
    }
    resize_geometric(&kind_rows->rows, kind_rows->begin[kGroups]);
    resize_geometric(&kind_rows->contacts, kind_rows->begin[kGroups]);
  };
  start(&spheres_, spheres);
  start(&manifolds_, manifolds);
  resize_geometric(&fixed_, fixed);
  parallel_for(pool_, setup_.contacts.size(), kContactsPerChunk,
               [&](std::size_t first, std::size_t last) {
                 place_contacts(static_cast<std::uint32_t>(first), static_cast<std::uint32_t>(last),
                                counts_[first / kContactsPerChunk]);
               });
  place_fixed_contacts();
  std::uint32_t points = 0;
  for (std::size_t i = 0; i < manifolds_.rows.size(); ++i) {
    manifolds_.rows[i].first = points;
    points += setup_.contacts.impulse_count(manifolds_.contacts[i]);
  }
  resize_geometric(&points_, points);
}

/// Fills kinds_, and counts_ by chunk of contacts.
void SoftStepSolver::count_contacts() {
  const std::uint32_t count = setup_.contacts.size();
  resize_geometric(&kinds_, count);
  resize_geometric(&counts_, (count + kContactsPerChunk - 1) / kContactsPerChunk);
  parallel_for(pool_, count, kContactsPerChunk, [this](std::size_t first, std::size_t last) {
    Counts& counts = counts_[first / kContactsPerChunk];
    counts = {};
    for (auto i = static_cast<std::uint32_t>(first); i < last; ++i) {
      kinds_[i] = setup_.kind_of(i);
      if (kinds_[i] == RowKind::none) continue;
      const std::size_t group = setup_.group_of(i);
      ++(kinds_[i] == RowKind::sphere ? counts.spheres : counts.manifolds)[group];
      if (group == kFixedGroup) ++counts.fixed;
    }
  });
}

/// Assigns rows to the contacts of a chunk. @param before number of rows in the chunks before
void SoftStepSolver::place_contacts(std::uint32_t first, std::uint32_t last, Counts before) {
  for (std::uint32_t i = first; i < last; ++i) {
    if (kinds_[i] == RowKind::none) continue;
    const std::size_t group = setup_.group_of(i);
    const bool is_sphere_row = kinds_[i] == RowKind::sphere;
    if (group == kFixedGroup) {
      const ContactKey& key = setup_.contacts.key(i);
      fixed_[before.fixed++] = {setup_.is_flipped(key) ? key.b : key.a, i, 0, is_sphere_row};
    } else if (is_sphere_row) {
      spheres_.contacts[spheres_.begin[group] + before.spheres[group]++] = i;
    } else {
      manifolds_.contacts[manifolds_.begin[group] + before.manifolds[group]++] = i;
    }
  }
}

/// Sorts the contacts with fixed bodies by movable body, and assigns their rows.
void SoftStepSolver::place_fixed_contacts() {
  const auto order = [](const FixedContact& x, const FixedContact& y) {
    return std::tie(x.body, x.contact) < std::tie(y.body, y.contact);
  };
  if (!std::ranges::is_sorted(fixed_, order)) std::ranges::sort(fixed_, order);
  std::uint32_t sphere = spheres_.begin[kFixedGroup], manifold = manifolds_.begin[kFixedGroup];
  for (FixedContact& fixed : fixed_) {
    fixed.row = fixed.is_sphere_row ? sphere++ : manifold++;
    (fixed.is_sphere_row ? spheres_.contacts : manifolds_.contacts)[fixed.row] = fixed.contact;
  }
}

void SoftStepSolver::build(const RowSetup& setup, const ImpactBodies& impacts,
                           const StepConstants& constants) {
  setup_ = setup;
  impacts_ = impacts;
  constants_ = constants;
  sort_contacts();
  const auto fill_all = [this](auto* kind_rows, const auto& fill) {
    const std::uint32_t first_fixed = kind_rows->begin[kFixedGroup];
    parallel_for(pool_, kind_rows->rows.size(), kRowsPerChunk,
                 [&](std::size_t first, std::size_t last) {
                   for (std::size_t i = first; i < last; ++i) {
                     const std::uint32_t contact = kind_rows->contacts[i];
                     i < first_fixed ? fill(&kind_rows->rows[i], contact, std::false_type())
                                     : fill(&kind_rows->rows[i], contact, std::true_type());
                   }
                 });
  };
  fill_all(&spheres_,
           [this]<bool kFixed>(SphereRow* row, std::uint32_t contact, std::bool_constant<kFixed>) {
             setup_.fill<kFixed>(row, contact);
           });
  fill_all(&manifolds_, [this]<bool kFixed>(ManifoldRow* row, std::uint32_t contact,
                                            std::bool_constant<kFixed>) {
    setup_.fill<kFixed>(row, &points_[row->first], contact);
  });
}

BodyPair SoftStepSolver::pair_of(const ManifoldRow& row, std::span<SolverBody> bodies) const {
  return {&bodies[row.a], &bodies[row.b], &setup_.properties.inverse_inertia[row.a],
          &setup_.properties.inverse_inertia[row.b]};
}

/// Calls operation(row, is_fixed) for all rows, in the order of the solver.
template <class Operation>
void SoftStepSolver::sweep(const Operation& operation) {
  const auto run = [&](auto* kind_rows, std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) operation(&kind_rows->rows[i], std::false_type());
  };
  run(&spheres_, 0, spheres_.begin[1]);
  run(&manifolds_, 0, manifolds_.begin[1]);
  for (std::size_t group = 1; group < kFixedGroup; ++group) {
    // One loop over the rows of both kinds: the end of a loop costs as much as dozens of rows.
    const std::size_t sphere = spheres_.begin[group], manifold = manifolds_.begin[group];
    const std::size_t spheres = spheres_.begin[group + 1] - sphere;
    const std::size_t manifolds = manifolds_.begin[group + 1] - manifold;
    parallel_for(
        pool_, spheres + manifolds, kRowsPerChunk, [&](std::size_t first, std::size_t last) {
          run(&spheres_, sphere + std::min(first, spheres), sphere + std::min(last, spheres));
          run(&manifolds_, manifold + std::max(first, spheres) - spheres,
              manifold + std::max(last, spheres) - spheres);
        });
  }
  parallel_for(pool_, fixed_.size(), kRowsPerChunk, [&](std::size_t first, std::size_t last) {
    // A chunk begins and ends at the first contact of a body.
    const auto is_inside = [this](std::size_t i) {
      return i > 0 && i < fixed_.size() && fixed_[i].body == fixed_[i - 1].body;
    };
    while (is_inside(first)) ++first;
    while (is_inside(last)) ++last;
    for (std::size_t i = first; i < last; ++i) {
      const FixedContact& fixed = fixed_[i];
      if (fixed.is_sphere_row) {
        operation(&spheres_.rows[fixed.row], std::true_type());
      } else {
        operation(&manifolds_.rows[fixed.row], std::true_type());
      }
    }
  });
}

template <class Operation>
void SoftStepSolver::run(std::span<SolverBody> bodies, const Operation& operation) {
  sweep([&]<class Row, bool kFixed>(Row* row, std::bool_constant<kFixed>) {
    if constexpr (std::is_same_v<Row, SphereRow>) {
      operation.template run<kFixed>(row, &bodies[row->a], &bodies[row->b], impacts_);
    } else {
      operation.template run<kFixed>(row, &points_[row->first], pair_of(*row, bodies));
    }
  });
}

void SoftStepSolver::warm_start(std::span<SolverBody> bodies) { run(bodies, WarmStart()); }

void SoftStepSolver::solve(std::span<SolverBody> bodies, bool soft) {
  if (soft) {
    run(bodies, Solve<true>{constants_});
  } else {
    run(bodies, Solve<false>{constants_});
  }
}

void SoftStepSolver::restitute(std::span<SolverBody> bodies) {
  if (!manifolds_.rows.empty()) run(bodies, Restitute());
}

void SoftStepSolver::store() {
  parallel_for(pool_, spheres_.rows.size(), 4096, [&](std::size_t first, std::size_t last) {
    for (std::size_t i = first; i < last; ++i) {
      setup_.store(spheres_.rows[i], spheres_.contacts[i]);
    }
  });
  parallel_for(pool_, manifolds_.rows.size(), 1024, [&](std::size_t first, std::size_t last) {
    for (std::size_t i = first; i < last; ++i) {
      const ManifoldRow& row = manifolds_.rows[i];
      setup_.store(row, &points_[row.first], manifolds_.contacts[i]);
    }
  });
}

}  // namespace soft_step
}  // namespace JFPX_ABI
}  // namespace jfpx
