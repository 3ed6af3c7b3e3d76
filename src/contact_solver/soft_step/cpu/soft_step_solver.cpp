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

/// Counting sort of the contacts and joints into rows by kind and group. Within a group, rows are
/// ordered by number; rows with fixed bodies are ordered by body.
void SoftStepSolver::sort_contacts() {
  count_contacts();
  Counts before;
  for (Counts& chunk : counts_) {
    for (std::uint32_t kind = 0; kind < kRowKinds; ++kind) {
      const auto add = [sums = &before.by_kind[kind],
                        counts = &chunk.by_kind[kind]](std::size_t g) {
        (*sums)[g] += std::exchange((*counts)[g], (*sums)[g]);
      };
      for (std::size_t g = 0; g < colored_end_; ++g) add(g);
      add(kFixedGroup);
    }
    before.fixed += std::exchange(chunk.fixed, before.fixed);
  }
  for_all_kinds([&]<class Row>(Rows<Row>* rows) {
    rows->start(before.by_kind[kKindOf<Row>], colored_end_, bodies_);
  });
  resize_geometric(&fixed_, before.fixed);
  parallel_for(pool_, setup_.size(), kContactsPerChunk, [&](std::size_t first, std::size_t last) {
    place_contacts(static_cast<std::uint32_t>(first), static_cast<std::uint32_t>(last),
                   counts_[first / kContactsPerChunk]);
  });
  for_all_kinds([](auto* rows) { rows->finish(); });
  place_fixed_contacts();
  place_parts();
}

/// Fills kinds_, and counts_ by chunk of contacts.
void SoftStepSolver::count_contacts() {
  const std::uint32_t count = setup_.size();
  resize_geometric(&kinds_, count);
  resize_geometric(&counts_, (count + kContactsPerChunk - 1) / kContactsPerChunk);
  const auto count_chunk = [this](std::size_t first, std::size_t last) {
    Counts& counts = counts_[first / kContactsPerChunk];
    counts = {};
    std::size_t colored_end = 0;
    for (auto i = static_cast<std::uint32_t>(first); i < last; ++i) {
      kinds_[i] = setup_.kind_of(i);
      if (kinds_[i] == kNoRow) continue;
      const std::size_t group = setup_.group_of(i);
      ++counts.by_kind[kinds_[i]][group];
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

/// Assigns rows to the contacts of a chunk. @param before number of rows in earlier chunks
void SoftStepSolver::place_contacts(std::uint32_t first, std::uint32_t last, Counts before) {
  for (std::uint32_t i = first; i < last; ++i) {
    const RowKind kind = kinds_[i];
    if (kind == kNoRow) continue;
    const std::size_t group = setup_.group_of(i);
    const ContactKey key = setup_.key(i);
    if (group == kFixedGroup) {
      fixed_[before.fixed++] = {setup_.movable_body(key), i, 0, kind};
      continue;
    }
    visit_row(kind, [&]<class Row>(std::type_identity<Row>) {
      const std::uint32_t row = rows<Row>().begin(group) + before.by_kind[kind][group]++;
      rows<Row>().place(group, row, i, std::min(key.a, key.b));
    });
  }
}

/// Sorts the contacts with fixed bodies by movable body, and assigns their rows.
void SoftStepSolver::place_fixed_contacts() {
  const auto order = [this](const FixedContact& x, const FixedContact& y) {
    return x.body != y.body ? x.body < y.body
                            : setup_.fixed_order(x.contact) < setup_.fixed_order(y.contact);
  };
  if (!std::ranges::is_sorted(fixed_, order)) std::ranges::sort(fixed_, order);
  std::array<std::uint32_t, kRowKinds> next{};
  for_all_kinds([&]<class Row>(Rows<Row>* rows) { next[kKindOf<Row>] = rows->begin(kFixedGroup); });
  for (FixedContact& fixed : fixed_) {
    fixed.row = next[fixed.kind]++;
    visit_row(fixed.kind, [&]<class Row>(std::type_identity<Row>) {
      rows<Row>().contacts[fixed.row] = fixed.contact;
    });
  }
}

/// Assigns parts to the rows of kinds with parts.
void SoftStepSolver::place_parts() {
  for_all_kinds([this]<class Row>(Rows<Row>* rows) {
    if constexpr (kHasParts<Row>) {
      std::uint32_t parts = 0;
      for (std::size_t i = 0; i < rows->size(); ++i) {
        rows->rows[i].first = parts;
        parts += setup_.contacts.impulse_count(rows->contacts[i]);
      }
      rows->parts.reserve_geometric(parts, "points of contacts");
    }
  });
}

void SoftStepSolver::build(const RowSetup& setup, std::size_t bodies, const ImpactBodies& impacts,
                           const StepConstants& constants) {
  setup_ = setup;
  impacts_ = impacts;
  constants_ = constants;
  bodies_ = bodies;
  sort_contacts();
  for_all_rows([this](auto* rows, std::size_t first, std::size_t last, auto is_fixed) {
    for (std::size_t i = first; i < last; ++i) {
      auto& row = rows->rows[i];
      setup_.fill<decltype(is_fixed)::value>(&row, rows->parts_of(row), rows->contacts[i]);
    }
  });
}

template <class Operation>
void SoftStepSolver::for_all_rows(const Operation& operation) {
  parallel_for(
      pool_, block_count(bodies_), kBlocksPerChunk, [&](std::size_t first, std::size_t last) {
        for_all_kinds([&](auto* rows) {
          for (std::size_t group = 0; group < colored_end_; ++group) {
            operation(rows, rows->begin(group, first), rows->begin(group, last), std::false_type());
          }
        });
      });
  for_all_kinds([&](auto* rows) {
    const std::size_t begin = rows->begin(kFixedGroup);
    parallel_for(pool_, rows->size(kFixedGroup), kRowsPerChunk,
                 [&](std::size_t first, std::size_t last) {
                   operation(rows, begin + first, begin + last, std::true_type());
                 });
  });
}

template <class Run, class OnFixed>
void SoftStepSolver::sweep(const Run& run, const OnFixed& on_fixed) {
  for_all_kinds([&](auto* rows) {
    for (std::size_t i = 0; i < rows->end(kOverflowGroup); ++i) run(rows, i, i + 1);
  });
  const std::size_t blocks = block_count(bodies_);
  for (std::size_t group = group_of_color(0); group < colored_end_; ++group) {
    // One loop over the rows of all kinds: ending a loop costs as much as dozens of rows.
    std::size_t count = 0;
    for_all_kinds([&](auto* rows) { count += rows->size(group); });
    if (count == 0) continue;
    const std::size_t chunk = std::max<std::size_t>(1, blocks * kRowsPerChunk / count);
    parallel_for(pool_, blocks, chunk, [&](std::size_t first, std::size_t last) {
      for_all_kinds(
          [&](auto* rows) { run(rows, rows->begin(group, first), rows->begin(group, last)); });
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
      visit_row(fixed_[i].kind,
                [&]<class Row>(std::type_identity<Row>) { on_fixed(&rows<Row>(), fixed_[i].row); });
    }
  });
}

/// @param kernel null: rows of spheres are solved one by one
template <class Operation>
void SoftStepSolver::run(std::span<SolverBody> bodies, const Operation& operation,
                         cpu::SphereSweepFunction kernel) {
  const auto one = [&](auto* rows, std::size_t i, auto is_fixed) {
    auto& row = rows->rows[i];
    using Row = std::remove_reference_t<decltype(row)>;
    const Mat3* const inertia = setup_.properties.inverse_inertia;
    RowContext<typename Row::Part, ImpactBodies> context{
        {&bodies[row.a], nullptr, &inertia[row.a], nullptr}, rows->parts_of(row), &impacts_};
    if (Row::kReadsOrientation && row.b == kWorld) {
      context.bodies.b = &world_;
      context.bodies.inertia_b = &world_inertia_;
    } else {
      context.bodies.b = &bodies[row.b];
      context.bodies.inertia_b = &inertia[row.b];
    }
    if constexpr (Row::kReadsOrientation) {
      const Quat* const orientation = setup_.properties.orientation;
      context.orientations = {&orientation[row.a],
                              row.b == kWorld ? &world_orientation_ : &orientation[row.b]};
    }
    operation.template run<decltype(is_fixed)::value>(&row, context);
  };
  const cpu::SphereSweep arrays = arrays_of(bodies);
  sweep(
      [&]<class Row>(Rows<Row>* rows, std::size_t first, std::size_t last) {
        if (!std::is_same_v<Row, SphereRow> || kernel == nullptr) {
          for (std::size_t i = first; i < last; ++i) one(rows, i, std::false_type());
          return;
        }
        for (std::size_t begin = first; begin < last; begin += kRowsPerKernel) {
          std::array<std::uint32_t, kRowsPerKernel> skipped;
          const std::size_t end = std::min(last, begin + kRowsPerKernel);
          const std::size_t count = kernel(arrays, begin, end, skipped.data());
          for (std::size_t k = 0; k < count; ++k) one(rows, skipped[k], std::false_type());
        }
      },
      [&](auto* rows, std::size_t row) { one(rows, row, std::true_type()); });
}

cpu::SphereSweep SoftStepSolver::arrays_of(std::span<SolverBody> bodies) {
  const StepConstants& c = constants_;
  const auto softness = [](const Softness& s) {
    return cpu::SweepSoftness{s.bias_rate, s.mass_scale, s.impulse_scale};
  };
  return {reinterpret_cast<Real*>(rows<SphereRow>().rows.data()),
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
  if (rows<ManifoldRow>().size() > 0) run(bodies, Restitute(), nullptr);
}

void SoftStepSolver::store() {
  for_all_rows([this](auto* rows, std::size_t first, std::size_t last, auto) {
    for (std::size_t i = first; i < last; ++i) {
      const auto& row = rows->rows[i];
      setup_.store(row, rows->parts_of(row), rows->contacts[i]);
    }
  });
}

}  // namespace soft_step
}  // namespace JFPX_ABI
}  // namespace jfpx
