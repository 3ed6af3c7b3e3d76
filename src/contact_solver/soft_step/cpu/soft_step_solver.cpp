/// Rows and sweeps of the soft step on the CPU; see the header.
#include "src/contact_solver/soft_step/cpu/soft_step_solver.hpp"

#include "src/base/cpu.hpp"
#include "src/base/parallel_for.hpp"
#include "src/base/reserve.hpp"
#include "src/contact_solver/soft_step/row_operations.hpp"

#include <algorithm>
#include <cstddef>
#include <tuple>
#include <type_traits>
#include <utility>

namespace jfpx {
inline namespace JFPX_ABI {
namespace soft_step {
namespace {

constexpr std::size_t kRowsPerChunk = 64, kContactsPerChunk = 4096, kBlocksPerChunk = 4;
constexpr std::size_t kRowsPerKernel = 64;

// The layout that sphere_sweep.hpp assumes.
constexpr std::size_t kReal = sizeof(Real);
static_assert(sizeof(SphereRow) == cpu::kSweepStride * kReal);
static_assert(offsetof(SphereRow, friction_impulse) == cpu::sphere_row_quad::kImpulses * kReal);
static_assert(offsetof(SphereRow, normal_impulse) == 3 * kReal);
static_assert(offsetof(SphereRow, normal) == cpu::sphere_row_quad::kNormal * kReal);
static_assert(offsetof(SphereRow, distance) == 7 * kReal);
static_assert(offsetof(SphereRow, friction) == cpu::sphere_row_quad::kFriction * kReal);
static_assert(offsetof(SphereRow, arm_a) == 9 * kReal && offsetof(SphereRow, arm_b) == 10 * kReal);
static_assert(offsetof(SphereRow, normal_mass) == 11 * kReal);
static_assert(offsetof(SphereRow, tangent_mass) == cpu::sphere_row_quad::kTangentMass * kReal);
static_assert(offsetof(SphereRow, a) == cpu::sphere_row_quad::kBodies * kReal);
static_assert(offsetof(SphereRow, b) == offsetof(SphereRow, a) + 4);
static_assert(sizeof(SolverBody) == cpu::kSweepStride * kReal);
static_assert(offsetof(SolverBody, inverse_mass) == 3 * kReal);
static_assert(offsetof(SolverBody, angular_velocity) ==
              cpu::solver_body_quad::kAngularVelocity * kReal);
static_assert(offsetof(SolverBody, inverse_inertia) == 7 * kReal);
static_assert(offsetof(SolverBody, shift) == cpu::solver_body_quad::kShift * kReal);

const cpu::SphereSweepKernels* kernels_for(SimdLevel level) {
#if defined(__x86_64__)
  if (level >= SimdLevel::avx2) return &cpu::kAvx2SphereSweep;
#else
  static_cast<void>(level);
#endif
  return nullptr;
}

}  // namespace

SoftStepSolver::SoftStepSolver(ThreadPool* pool, SimdLevel simd)
    : pool_(pool), kernels_(kernels_for(usable_simd_level(simd))) {}

/// Counting sort of the contacts into rows by kind and group. Rows of a group are in the order of
/// contacts, those with fixed bodies in the order of bodies.
void SoftStepSolver::sort_contacts() {
  count_contacts();
  GroupCounts spheres{}, manifolds{};
  std::uint32_t fixed = 0;
  for (Counts& chunk : counts_) {
    const auto add = [&](std::size_t g) {
      spheres[g] += std::exchange(chunk.spheres[g], spheres[g]);
      manifolds[g] += std::exchange(chunk.manifolds[g], manifolds[g]);
    };
    for (std::size_t g = 0; g < colored_end_; ++g) add(g);
    add(kFixedGroup);
    fixed += std::exchange(chunk.fixed, fixed);
  }
  spheres_.start(spheres, colored_end_, bodies_);
  manifolds_.start(manifolds, colored_end_, bodies_);
  resize_geometric(&fixed_, fixed);
  parallel_for(pool_, setup_.contacts.size(), kContactsPerChunk,
               [&](std::size_t first, std::size_t last) {
                 place_contacts(static_cast<std::uint32_t>(first), static_cast<std::uint32_t>(last),
                                counts_[first / kContactsPerChunk]);
               });
  spheres_.finish();
  manifolds_.finish();
  place_fixed_contacts();
  std::uint32_t points = 0;
  for (std::size_t i = 0; i < manifolds_.size(); ++i) {
    manifolds_.rows[i].first = points;
    points += setup_.contacts.impulse_count(manifolds_.contacts[i]);
  }
  points_.reserve_geometric(points, "points of contacts");
}

/// Fills kinds_, and counts_ by chunk of contacts.
void SoftStepSolver::count_contacts() {
  const std::uint32_t count = setup_.contacts.size();
  resize_geometric(&kinds_, count);
  resize_geometric(&counts_, (count + kContactsPerChunk - 1) / kContactsPerChunk);
  const auto count_chunk = [this](std::size_t first, std::size_t last) {
    Counts& counts = counts_[first / kContactsPerChunk];
    counts = {};
    std::size_t colored_end = 0;
    for (auto i = static_cast<std::uint32_t>(first); i < last; ++i) {
      kinds_[i] = setup_.kind_of(i);
      if (kinds_[i] == RowKind::none) continue;
      const std::size_t group = setup_.group_of(i);
      ++(kinds_[i] == RowKind::sphere ? counts.spheres : counts.manifolds)[group];
      if (group == kFixedGroup) {
        ++counts.fixed;
      } else {
        colored_end = std::max(colored_end, group + 1);
      }
    }
    return colored_end;
  };
  colored_end_ = parallel_reduce(pool_, count, kContactsPerChunk, std::size_t{0}, count_chunk,
                                 std::ranges::max);
}

/// Assigns rows to the contacts of a chunk. @param before number of rows in the chunks before
void SoftStepSolver::place_contacts(std::uint32_t first, std::uint32_t last, Counts before) {
  for (std::uint32_t i = first; i < last; ++i) {
    if (kinds_[i] == RowKind::none) continue;
    const std::size_t group = setup_.group_of(i);
    const bool is_sphere_row = kinds_[i] == RowKind::sphere;
    const ContactKey& key = setup_.contacts.key(i);
    if (group == kFixedGroup) {
      fixed_[before.fixed++] = {setup_.is_flipped(key) ? key.b : key.a, i, 0, is_sphere_row};
    } else if (is_sphere_row) {
      spheres_.place(group, spheres_.begin(group) + before.spheres[group]++, i, key.a);
    } else {
      manifolds_.place(group, manifolds_.begin(group) + before.manifolds[group]++, i, key.a);
    }
  }
}

/// Sorts the contacts with fixed bodies by movable body, and assigns their rows.
void SoftStepSolver::place_fixed_contacts() {
  const auto order = [](const FixedContact& x, const FixedContact& y) {
    return std::tie(x.body, x.contact) < std::tie(y.body, y.contact);
  };
  if (!std::ranges::is_sorted(fixed_, order)) std::ranges::sort(fixed_, order);
  std::uint32_t sphere = spheres_.begin(kFixedGroup), manifold = manifolds_.begin(kFixedGroup);
  for (FixedContact& fixed : fixed_) {
    fixed.row = fixed.is_sphere_row ? sphere++ : manifold++;
    (fixed.is_sphere_row ? spheres_.contacts : manifolds_.contacts)[fixed.row] = fixed.contact;
  }
}

void SoftStepSolver::build(const RowSetup& setup, std::size_t bodies, const ImpactBodies& impacts,
                           const StepConstants& constants) {
  setup_ = setup;
  impacts_ = impacts;
  constants_ = constants;
  bodies_ = bodies;
  sort_contacts();
  const auto fill = [this](auto* row, std::uint32_t contact, auto is_fixed) {
    constexpr bool kFixed = decltype(is_fixed)::value;
    if constexpr (std::is_same_v<decltype(row), SphereRow*>) {
      setup_.fill<kFixed>(row, contact);
    } else {
      setup_.fill<kFixed>(row, &points_[row->first], contact);
    }
  };
  for_all_rows([&](auto* grouped, std::size_t first, std::size_t last, auto is_fixed) {
    for (std::size_t i = first; i < last; ++i) {
      fill(&grouped->rows[i], grouped->contacts[i], is_fixed);
    }
  });
}

BodyPair SoftStepSolver::pair_of(const ManifoldRow& row, std::span<SolverBody> bodies) const {
  return {&bodies[row.a], &bodies[row.b], &setup_.properties.inverse_inertia[row.a],
          &setup_.properties.inverse_inertia[row.b]};
}

template <class Operation>
void SoftStepSolver::for_all_rows(const Operation& operation) {
  const auto of_blocks = [&](auto* rows, std::size_t first, std::size_t last) {
    for (std::size_t group = 0; group < colored_end_; ++group) {
      operation(rows, rows->begin(group, first), rows->begin(group, last), std::false_type());
    }
  };
  parallel_for(pool_, block_count(bodies_), kBlocksPerChunk,
               [&](std::size_t first, std::size_t last) {
                 of_blocks(&spheres_, first, last);
                 of_blocks(&manifolds_, first, last);
               });
  const auto fixed = [&](auto* rows) {
    const std::size_t begin = rows->begin(kFixedGroup);
    parallel_for(pool_, rows->size(kFixedGroup), kRowsPerChunk,
                 [&](std::size_t first, std::size_t last) {
                   operation(rows, begin + first, begin + last, std::true_type());
                 });
  };
  fixed(&spheres_);
  fixed(&manifolds_);
}

template <class RunSpheres, class RunManifolds, class OnFixed>
void SoftStepSolver::sweep(const RunSpheres& run_spheres, const RunManifolds& run_manifolds,
                           const OnFixed& on_fixed) {
  for (std::size_t i = 0; i < spheres_.end(kOverflowGroup); ++i) run_spheres(i, i + 1);
  run_manifolds(0, manifolds_.end(kOverflowGroup));
  const std::size_t blocks = block_count(bodies_);
  for (std::size_t group = group_of_color(0); group < colored_end_; ++group) {
    // One loop over the rows of both kinds: the end of a loop costs as much as dozens of rows.
    const std::size_t count = spheres_.size(group) + manifolds_.size(group);
    if (count == 0) continue;
    const std::size_t chunk = std::max<std::size_t>(1, blocks * kRowsPerChunk / count);
    parallel_for(pool_, blocks, chunk, [&](std::size_t first, std::size_t last) {
      run_spheres(spheres_.begin(group, first), spheres_.begin(group, last));
      run_manifolds(manifolds_.begin(group, first), manifolds_.begin(group, last));
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
        on_fixed(&spheres_.rows[fixed.row]);
      } else {
        on_fixed(&manifolds_.rows[fixed.row]);
      }
    }
  });
}

/// @param kernel null: rows of spheres are treated one by one
template <class Operation>
void SoftStepSolver::run(std::span<SolverBody> bodies, const Operation& operation,
                         cpu::SphereSweepFunction kernel) {
  const auto one = [&](auto* row, auto is_fixed) {
    constexpr bool kFixed = decltype(is_fixed)::value;
    if constexpr (std::is_same_v<decltype(row), SphereRow*>) {
      operation.template run<kFixed>(row, &bodies[row->a], &bodies[row->b], impacts_);
    } else {
      operation.template run<kFixed>(row, &points_[row->first], pair_of(*row, bodies));
    }
  };
  const cpu::SphereSweep arrays = arrays_of(bodies);
  sweep(
      [&](std::size_t first, std::size_t last) {
        if (kernel == nullptr) {
          for (std::size_t i = first; i < last; ++i) one(&spheres_.rows[i], std::false_type());
          return;
        }
        for (std::size_t begin = first; begin < last; begin += kRowsPerKernel) {
          std::array<std::uint32_t, kRowsPerKernel> skipped;
          const std::size_t end = std::min(last, begin + kRowsPerKernel);
          const std::size_t count = kernel(arrays, begin, end, skipped.data());
          for (std::size_t k = 0; k < count; ++k) {
            one(&spheres_.rows[skipped[k]], std::false_type());
          }
        }
      },
      [&](std::size_t first, std::size_t last) {
        for (std::size_t i = first; i < last; ++i) one(&manifolds_.rows[i], std::false_type());
      },
      [&](auto* row) { one(row, std::true_type()); });
}

cpu::SphereSweep SoftStepSolver::arrays_of(std::span<SolverBody> bodies) {
  const StepConstants& c = constants_;
  const auto softness = [](const Softness& s) {
    return cpu::SweepSoftness{s.bias_rate, s.mass_scale, s.impulse_scale};
  };
  return {reinterpret_cast<Real*>(spheres_.rows.data()),
          reinterpret_cast<Real*>(bodies.data()),
          c.h,
          c.inverse_h,
          c.push_out_speed,
          c.max_bias_velocity,
          c.restitution_threshold,
          softness(c.balls),
          softness(c.deep_balls),
          kDeepPenetration};
}

void SoftStepSolver::warm_start(std::span<SolverBody> bodies) {
  run(bodies, WarmStart(), kernels_ != nullptr ? kernels_->warm_start : nullptr);
}

void SoftStepSolver::solve(std::span<SolverBody> bodies, bool use_bias) {
  const cpu::SphereSweepFunction kernel = kernels_ != nullptr ? kernels_->solve[use_bias] : nullptr;
  if (use_bias) {
    run(bodies, Solve<true>{constants_}, kernel);
  } else {
    run(bodies, Solve<false>{constants_}, kernel);
  }
}

void SoftStepSolver::restitute(std::span<SolverBody> bodies) {
  if (manifolds_.size() > 0) run(bodies, Restitute(), nullptr);
}

void SoftStepSolver::store() {
  for_all_rows([this](auto* grouped, std::size_t first, std::size_t last, auto) {
    for (std::size_t i = first; i < last; ++i) {
      const auto& row = grouped->rows[i];
      if constexpr (std::is_same_v<decltype(row), const SphereRow&>) {
        setup_.store(row, grouped->contacts[i]);
      } else {
        setup_.store(row, &points_[row.first], grouped->contacts[i]);
      }
    }
  });
}

}  // namespace soft_step
}  // namespace JFPX_ABI
}  // namespace jfpx
