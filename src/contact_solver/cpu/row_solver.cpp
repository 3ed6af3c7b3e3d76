/// Arrangement of rows in blocks, and the threads that sweep over them; see the header.
#include "src/contact_solver/cpu/row_solver.hpp"

#include "src/base/backoff.hpp"
#include "src/base/cpu.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <chrono>
#include <cmath>
#include <limits>
#include <utility>

namespace jfpx {
inline namespace JFPX_ABI {
namespace cpu {
namespace {

using Clock = std::chrono::steady_clock;

/// Blocks of a color that are worth a thread: about half a microsecond of work, several times what
/// the threads wait for each other.
constexpr std::uint32_t kBlocksPerPart = 12;
/// Below this number of blocks, waking a second thread costs more than it saves.
constexpr std::uint32_t kBlocksPerThread = 64;
/// Number of waits after which a thread takes over the items of another one, which may have lost
/// its core: some microseconds, longer than an item of blocks takes.
constexpr std::uint64_t kWaitsForOthers = 200;
/// Number of bodies from whose positions the parts are derived, at most.
constexpr std::size_t kSample = 256;
/// First of the two alternatives of the chooser; the other is one thread.
constexpr std::size_t kSeveralThreads = 0;
/// [us] Shorter than any sweep over a block, so that the chooser measures both alternatives.
constexpr double kLowerBoundBlockUs = 1e-4;

double us_since(Clock::time_point start) {
  return std::chrono::duration<double, std::micro>(Clock::now() - start).count();
}

const RowKernels& row_kernels([[maybe_unused]] SimdLevel simd) {
#if defined(__x86_64__)
  if (usable_simd_level(simd) >= SimdLevel::avx2) return kAvx2RowKernels;
#endif
  return kScalarRowKernels;
}

bool all_finite(const Real* values, std::size_t count) {
  bool finite = true;
  for (std::size_t i = 0; i < count; ++i) {
    finite &= std::abs(values[i]) <= std::numeric_limits<Real>::max();
  }
  return finite;
}

}  // namespace

/// A thread that sweeps, written by itself except for its presence.
struct alignas(64) RowSolver::Participant {
  std::atomic<std::uint64_t> done[kPrograms];  ///< by program: number of items that it has solved
  std::atomic<bool> present;                   ///< whether it solves the items of its part

  bool is_present() const { return present.load(std::memory_order_relaxed); }
  /// Writes only changes, because other threads read the cache line.
  void set_present(bool value) {
    if (is_present() != value) present.store(value, std::memory_order_relaxed);
  }
};

/// For each item, the number of iterations in which it was claimed.
struct alignas(64) RowSolver::ClaimLine {
  std::atomic<std::uint32_t> items[kClaimsPerLine];
};

/// Passes over the blocks, repeated until the residual is small. Each pass is a sequence of stages,
/// which end when all of their items are done. A thread solves the items of its part of the bodies,
/// so that its caches keep them, and takes over those of threads that are absent or late. A waiting
/// thread has claimed nothing and may leave.
struct RowSolver::Program {
  struct Pass {
    RowSweep sweep;  ///< null: the serial rows
    const WorkList* list;
    ClaimLine* claims;
  };

  RowArrays arrays{};
  Pass passes[4];
  std::size_t pass_count = 0;
  std::uint64_t iterations = 0;        ///< iterations of the serial rows and of all
  std::uint64_t block_iterations = 0;  ///< iterations that include the blocks
  SerialRows* serial = nullptr;
  Real threshold = -1;
  std::atomic<Real>* residuals = nullptr;  ///< one per iteration
  std::size_t number = 0;                  ///< of the program
  std::span<Participant> participants{};   ///< by part
  std::atomic<bool> broken{false};

  /// Runs the program, together with the other threads that join.
  /// @param self the part of this thread
  /// @return false if the backoff has reached its limit before the end
  bool join(std::uint32_t self, Backoff backoff) {
    std::uint64_t before = 0;  // number of items of earlier stages
    for (std::uint64_t iteration = 0; iteration < iterations; ++iteration) {
      if (iteration > 0 && is_last(iteration - 1)) break;
      Real raised = 0;
      for (std::size_t i = 0; i < pass_count; ++i) {
        const Pass& pass = passes[i];
        if (pass.sweep != nullptr && iteration >= block_iterations) continue;
        for (const WorkStage& stage : pass.list->stages()) {
          if (!run_stage(pass, stage, iteration, before, self, backoff, &raised)) return false;
          before += stage.last - stage.first;
        }
      }
    }
    return true;
  }

  int iterations_done() const {
    if (iterations == 0) return 0;
    std::uint64_t i = 0;
    while (!is_last(i)) ++i;
    return static_cast<int>(i) + 1;
  }

 private:
  /// @param before number of items of earlier stages, which are done
  /// @param raised the residual of the iteration is at least that
  bool run_stage(const Pass& pass, const WorkStage& stage, std::uint64_t iteration,
                 std::uint64_t before, std::uint32_t self, Backoff backoff, Real* raised) {
    const std::uint64_t after = before + (stage.last - stage.first);
    if (is_done(after)) return true;
    participants[self].set_present(true);
    const WorkItem* const items = pass.list->items();
    for (std::uint32_t i = stage.first; i < stage.last; ++i) {
      const std::uint32_t part = items[i].part;
      if (part == self || !participants[part].is_present()) {
        run_item(pass, items[i], iteration, self, raised);
      }
    }
    for (std::uint64_t waits = 1; !is_done(after); ++waits) {
      if (!backoff.wait()) {
        participants[self].set_present(false);
        return false;
      }
      if (waits % kWaitsForOthers != 0) continue;
      for (std::uint32_t i = stage.first; i < stage.last; ++i) {
        if (run_item(pass, items[i], iteration, self, raised)) {
          participants[items[i].part].set_present(false);
        }
      }
    }
    return true;
  }

  /// @return whether the item was not claimed before
  bool run_item(const Pass& pass, const WorkItem& item, std::uint64_t iteration, std::uint32_t self,
                Real* raised) {
    auto claimed = static_cast<std::uint32_t>(iteration);
    std::atomic<std::uint32_t>& claim =
        pass.claims[item.claim / kClaimsPerLine].items[item.claim % kClaimsPerLine];
    if (!claim.compare_exchange_strong(claimed, claimed + 1, std::memory_order_relaxed)) {
      return false;
    }
    RowResidual residual;
    if (pass.sweep != nullptr) {
      pass.sweep(arrays, item.blocks.first, item.blocks.last, &residual);
    } else {
      serial->sweep(static_cast<int>(iteration), &residual);
    }
    if (residual.broken) broken.store(true, std::memory_order_relaxed);
    if (residual.largest > *raised) raise(residuals + iteration, *raised = residual.largest);
    std::atomic<std::uint64_t>& done = participants[self].done[number];
    done.store(done.load(std::memory_order_relaxed) + 1, std::memory_order_release);
    return true;
  }

  /// Whether all threads together have completed so many items.
  bool is_done(std::uint64_t items) const {
    std::uint64_t sum = 0;
    for (const Participant& participant : participants) {
      sum += participant.done[number].load(std::memory_order_acquire);
    }
    return sum >= items;
  }
  bool is_last(std::uint64_t iteration) const {
    return iteration + 1 == iterations ||
           residuals[iteration].load(std::memory_order_relaxed) <= threshold;
  }
  static void raise(std::atomic<Real>* value, Real to) {
    Real now = value->load(std::memory_order_relaxed);
    while (to > now && !value->compare_exchange_weak(now, to, std::memory_order_relaxed)) {
    }
  }
};

RowSolver::~RowSolver() = default;

RowSolver::RowSolver(unsigned threads, SimdLevel simd)
    : kernels_(row_kernels(simd)), pool_(threads) {
  static_assert(ThreadPool::kMaxThreads <= 256, "part_of_body_ has a byte a body");
  // The pool may have more threads later.
  most_parts_ = pool_.threads();
  participants_ = std::make_unique<Participant[]>(most_parts_);
  constexpr BlockRange kOne{0, 1};
  serial_list_.build({&kOne, 1}, 1);
}

void RowSolver::resize_bodies(std::size_t count) {
  bodies_.reserve(count * rows::kBodyFields, "bodies of a solver", body_count_ * rows::kBodyFields);
  velocities_.reserve(count * rows::kVelocityFields, "velocities of a solver",
                      body_count_ * rows::kVelocityFields);
  push_velocities_.reserve(count * rows::kVelocityFields, "velocities of a solver",
                           body_count_ * rows::kVelocityFields);
  factors_.reserve(count * rows::kFactorFields, "factors of a solver",
                   body_count_ * rows::kFactorFields);
  positions_.reserve(count, "bodies of a solver", body_count_);
  body_count_ = count;
  is_divided_ = false;
  std::fill_n(body(0), rows::kBodyFields, Real(0));
  std::fill_n(velocity(0), rows::kVelocityFields, Real(0));
  std::fill_n(push_velocity(0), rows::kVelocityFields, Real(0));
  std::fill_n(factors(0), rows::kFactorFields, Real(0));
  set_position(0, {});
}

void RowSolver::schedule(std::span<const RowPair> pairs, std::uint32_t directions) {
  directions_ = directions;
  rolling_friction_blocks_.count = 0;
  rolling_friction_blocks_.list.build({}, 1);
  coloring_.build(pairs, body_count_);
  pairs_ = pairs;
  choose_parts();
  const auto start = chooser_ != nullptr ? Clock::now() : Clock::time_point{};
  if (parts_ > 1) divide_bodies();
  if (chooser_ != nullptr) division_us_ = us_since(start);
  const std::uint32_t lanes = kernels_.lanes;
  const std::size_t groups = std::size_t{colors()} * parts_;
  ranges_.reserve(groups, "contacts of a solver");
  next_lane_.reserve(groups, "contacts of a solver");
  const auto group_of = [&](std::size_t contact) {
    const std::uint32_t color = coloring_.colors_of_contacts()[contact];
    const bool is_small = coloring_.contacts_of(color) <= WorkList::kSmallColor * lanes;
    return std::size_t{color} * parts_ + (is_small ? 0 : part_of(pairs[contact]));
  };
  std::fill_n(next_lane_.data(), groups, 0u);
  for (std::size_t i = 0; i < pairs.size(); ++i) ++next_lane_[group_of(i)];
  // The blocks of a part follow each other, so that its thread sets them up.
  blocks_ = 0;
  for (std::uint32_t part = 0; part < parts_; ++part) {
    for (std::size_t group = part; group < groups; group += parts_) {
      const std::uint32_t first = blocks_;
      blocks_ += (next_lane_[group] + lanes - 1) / lanes;
      ranges_[group] = {first, blocks_};
      next_lane_[group] = first * lanes;
    }
  }
  const std::size_t slots = std::size_t{blocks_} * lanes;
  order_.reserve(slots, "contacts of a solver");
  ids_.reserve(2 * slots, "contacts of a solver");
  contacts_.reserve(slots * rows::kContactFields, "rows of a solver");
  frictions_.reserve(slots * directions * rows::kFrictionFields, "rows of a solver");
  std::fill_n(order_.data(), slots, kNoContact);
  std::fill_n(ids_.data(), 2 * slots, rows::kFixedBody);
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    const std::uint32_t slot = next_lane_[group_of(i)]++;
    order_[slot] = static_cast<std::uint32_t>(i);
    std::int32_t* ids = ids_.data() + std::size_t{slot / lanes} * 2 * lanes + slot % lanes;
    ids[0] = slot_of_id(pairs[i].a);
    ids[lanes] = slot_of_id(pairs[i].b);
  }
  list_.build({ranges_.data(), groups}, parts_);
}

/// Chooses between one part and as many threads as have kBlocksPerPart blocks of each color on
/// average.
void RowSolver::choose_parts() {
  const std::size_t blocks = pairs_.size() / kernels_.lanes;
  const std::size_t most =
      std::min(blocks / kBlocksPerThread, blocks / (kBlocksPerPart * std::max(colors(), 1u)));
  parts_ = static_cast<std::uint32_t>(std::clamp<std::size_t>(most, 1, std::size_t{most_parts_}));
  chooser_ = nullptr;
  if (parts_ == 1) return;
  chooser_ = &choosers_[std::bit_width(blocks)];
  predicted_us_ = kLowerBoundBlockUs * static_cast<double>(blocks);
  const std::array predicted{predicted_us_, predicted_us_};
  const auto decision = chooser_->choose(static_cast<double>(blocks), predicted);
  if (decision.alternative != kSeveralThreads) parts_ = 1;
}

/// Divides the bodies into parts of about equal numbers along the longest axis, so that few
/// contacts join bodies of two parts. The results do not depend on the parts.
void RowSolver::divide_bodies() {
  // Quantiles of a sample, because single bodies may be far away.
  std::array<Real, kSample> longest{};
  std::size_t count = 0;
  int axis = 0;
  Real length = -1;
  const std::size_t stride = (body_count_ + kSample - 1) / kSample;
  for (int k = 0; k < 3; ++k) {
    std::array<Real, kSample> sample{};
    count = 0;
    for (std::size_t i = 1; i < body_count_; i += stride) {
      const Real position = positions_[i][k];
      sample[count++] = std::isfinite(position) ? position : 0;
    }
    std::sort(sample.begin(), sample.begin() + static_cast<std::ptrdiff_t>(count));
    const Real middle = sample[count - 1 - count / 8] - sample[count / 8];
    if (!(middle > length)) continue;
    length = middle;
    axis = k;
    longest = sample;
  }
  std::array<Real, ThreadPool::kMaxThreads> ends{};
  for (std::size_t part = 0; part + 1 < parts_; ++part) {
    ends[part] = longest[(part + 1) * count / parts_];
  }
  const auto last = ends.begin() + static_cast<std::ptrdiff_t>(parts_ - 1);
  part_of_body_.reserve(body_count_, "bodies of a solver");
  part_of_body_[0] = 0;
  for (std::size_t i = 1; i < body_count_; ++i) {
    const auto end = std::upper_bound(ends.begin(), last, positions_[i][axis]);
    part_of_body_[i] = static_cast<std::uint8_t>(end - ends.begin());
  }
  assign_slots();
}

/// Orders the bodies by their parts in the arrays that sweeps change, so that threads write to
/// different cache lines.
void RowSolver::assign_slots() {
  std::array<std::uint32_t, ThreadPool::kMaxThreads> next_slot{};
  for (std::size_t i = 0; i < body_count_; ++i) ++next_slot[part_of_body_[i]];
  std::uint32_t slot = 0;
  for (std::uint32_t& next : next_slot) slot += std::exchange(next, slot);
  slots_.reserve(body_count_, "bodies of a solver");
  for (std::size_t i = 0; i < body_count_; ++i) slots_[i] = next_slot[part_of_body_[i]]++;
  is_divided_ = true;
  to_slots(&velocities_, rows::kVelocityFields);
  to_slots(&push_velocities_, rows::kVelocityFields);
  to_slots(&factors_, rows::kFactorFields);
}

/// Moves values of the bodies to their slots.
void RowSolver::to_slots(Buffer<Real>* values, std::size_t fields) {
  spare_values_.reserve(body_count_ * fields, "bodies of a solver");
  constexpr std::size_t kBodiesPerChunk = 1024;
  pool_.run((body_count_ + kBodiesPerChunk - 1) / kBodiesPerChunk, [&](std::size_t chunk) {
    const std::size_t last = std::min(body_count_, (chunk + 1) * kBodiesPerChunk);
    for (std::size_t i = chunk * kBodiesPerChunk; i < last; ++i) {
      std::copy_n(values->data() + i * fields, fields, spare_values_.data() + slots_[i] * fields);
    }
  });
  std::swap(*values, spare_values_);
}

/// The part of the first body that moves.
std::uint32_t RowSolver::part_of(const RowPair& pair) const {
  if (parts_ == 1) return 0;
  const std::int32_t body = pair.a >= 0 ? pair.a : std::max(pair.b, 0);
  return part_of_body_[static_cast<std::size_t>(body)];
}

/// The bodies of a block: all bodies a, then all bodies b.
RowSolver::BlockIds RowSolver::ids_of(std::uint32_t block) const {
  BlockIds ids;
  ids.fill(rows::kFixedBody);
  const std::uint32_t* const contacts = contacts_of(block);
  for (std::uint32_t lane = 0; lane < kernels_.lanes && contacts[lane] != kNoContact; ++lane) {
    ids[lane] = pairs_[contacts[lane]].a;
    ids[kernels_.lanes + lane] = pairs_[contacts[lane]].b;
  }
  return ids;
}

unsigned RowSolver::set_up_contacts(const rows::RowSettings& settings, std::uint32_t block,
                                    const Real* inputs, Real* second) {
  return kernels_.set_up_contacts(settings, inputs, bodies_.data(), ids_of(block).data(),
                                  contact_rows(block), friction_rows(block), second);
}
void RowSolver::set_up_frictions(const rows::RowSettings& settings, std::uint32_t block,
                                 std::uint32_t direction, const Real* inputs) {
  kernels_.set_up_frictions(settings, inputs, bodies_.data(), ids_of(block).data(),
                            friction_rows(block, direction));
}

/// Prepares claims of items, and the presence of the threads.
void RowSolver::reset_claims(std::uint32_t count) {
  if (count > claim_capacity_) {
    claims_ = std::make_unique<ClaimLine[]>(count / kClaimsPerLine);
    claim_capacity_ = count;
  }
  for (std::uint32_t i = 0; i < count / kClaimsPerLine; ++i) {
    for (auto& item : claims_[i].items) item.store(0, std::memory_order_relaxed);
  }
  for (std::uint32_t i = 0; i < parts_; ++i) {
    for (auto& done : participants_[i].done) done.store(0, std::memory_order_relaxed);
    participants_[i].set_present(false);
  }
}

RowSweepReport RowSolver::solve(const RowSweepSettings& settings, bool with_factors) {
  const std::size_t factors = with_factors ? 1 : 0;
  std::uint64_t split_rows = 0;
  if (settings.split_impulse) {
    // Most contacts do not penetrate deeply enough for a split impulse: only blocks that contain
    // such a contact are swept.
    select(
        [&](std::uint32_t block) {
          const Real* rhs = contact_rows(block) + std::size_t{rows::kRowSplitRhs} * kernels_.lanes;
          const auto here = std::count_if(rhs, rhs + kernels_.lanes, [](Real r) { return r != 0; });
          split_rows += static_cast<std::uint64_t>(here);
          return here > 0;
        },
        &split_impulse_blocks_);
  }
  const auto iterations =
      static_cast<std::size_t>(std::max({settings.iterations, settings.serial_iterations, 0}));
  const auto block_iterations = static_cast<std::size_t>(std::max(settings.iterations, 0));
  if (2 * iterations + 1 > residual_capacity_) {
    residuals_ = std::make_unique<std::atomic<Real>[]>(2 * iterations + 1);
    residual_capacity_ = 2 * iterations + 1;
  }
  for (std::size_t i = 0; i < 2 * iterations + 1; ++i) residuals_[i] = 0;

  RowArrays arrays{.ids = ids_.data(),
                   .velocities = velocities_.data(),
                   .push_velocities = push_velocities_.data(),
                   .factors = with_factors ? factors_.data() : nullptr,
                   .contacts = contacts_.data(),
                   .frictions = frictions_.data(),
                   .directions = directions_,
                   .split_impulse_blocks = split_impulse_blocks_.blocks.data(),
                   .rolling_friction_blocks = rolling_friction_blocks_.blocks.data(),
                   .rolling_frictions = rolling_frictions_.data()};
  const std::uint32_t claims = 3 * list_.claims() + split_impulse_blocks_.list.claims() +
                               rolling_friction_blocks_.list.claims() + serial_list_.claims();
  reset_claims(claims);
  ClaimLine* next_claim = claims_.get();
  const auto add = [&](Program* program, RowSweep sweep, const WorkList& list) {
    program->passes[program->pass_count++] = {sweep, &list, next_claim};
    next_claim += list.claims() / kClaimsPerLine;
  };
  Program warm, split, main;
  for (Program* program : {&warm, &split, &main}) {
    program->arrays = arrays;
    program->iterations = program->block_iterations = block_iterations;
    program->threshold = settings.threshold;
    program->participants = {participants_.get(), parts_};
  }
  split.number = 1;
  main.number = 2;
  add(&warm, kernels_.warm_starts[factors], list_);
  warm.iterations = settings.warm_start ? 1 : 0;
  warm.residuals = residuals_.get() + 2 * iterations;
  add(&split, kernels_.split_impulses[factors], split_impulse_blocks_.list);
  split.iterations = split_rows > 0 ? block_iterations : 0;
  split.residuals = residuals_.get() + iterations;
  main.residuals = residuals_.get();
  main.iterations = iterations;
  main.serial = settings.serial;
  if (settings.serial != nullptr) add(&main, nullptr, serial_list_);
  if (settings.interleave) {
    add(&main, kernels_.both[factors], list_);
  } else {
    add(&main, kernels_.contacts[factors], list_);
    add(&main, kernels_.frictions[factors], list_);
  }
  add(&main, kernels_.rolling_frictions[factors], rolling_friction_blocks_.list);
  // The first participant always stays, so that the work is completed. The others leave when they
  // wait for long: then there are more threads than free processors, and they only take time from
  // the threads that work.
  const auto start = chooser_ != nullptr ? Clock::now() : Clock::time_point{};
  pool_.run(parts_, [&](std::size_t participant) {
    const auto self = static_cast<std::uint32_t>(participant);
    const Backoff backoff(self == 0);
    for (Program* program : {&warm, &split, &main}) {
      if (!program->join(self, backoff)) return;
    }
  });

  RowSweepReport report;
  report.iterations = main.iterations_done();
  if (chooser_ != nullptr) {
    const double us = division_us_ + us_since(start);
    chooser_->record(us / (report.iterations + 1), predicted_us_);
  }
  if (report.iterations > 0) {
    report.residual = residuals_[static_cast<std::size_t>(report.iterations) - 1];
  }
  report.split_impulses = split_rows * static_cast<std::uint64_t>(split.iterations_done());
  const std::size_t numbers = body_count_ * rows::kVelocityFields;
  report.broken = main.broken || split.broken || !all_finite(velocities_.data(), numbers) ||
                  !all_finite(push_velocities_.data(), numbers);
  return report;
}

}  // namespace cpu
}  // namespace JFPX_ABI
}  // namespace jfpx
