/// Arrangement of rows in blocks, and the threads that sweep over them; see the header.
#include "src/contact_solver/sequential_impulse/cpu/row_solver.hpp"

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

/// Minimum number of blocks per color and thread: about half a microsecond of work, several times
/// the waiting time of the threads.
constexpr std::uint32_t kBlocksPerPart = 12;
/// Below this number of blocks, waking a second thread costs more than it saves.
constexpr std::uint32_t kBlocksPerThread = 64;
/// Number of waits after which a thread executes the items of another thread, which may have been
/// descheduled. Some microseconds, longer than an item of blocks.
constexpr std::uint64_t kWaitsForOthers = 200;
/// Maximum number of bodies whose positions determine the parts.
constexpr std::size_t kSample = 256;
/// First of the two alternatives of the chooser; the other is one thread.
constexpr std::size_t kSeveralThreads = 0;

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

/// Progress of a part in a program. While shared contacts wait, other threads read only the last
/// member, which therefore has its own cache line.
struct alignas(64) RowSolver::PartProgress {
  std::atomic<std::uint64_t> claimed, done;            ///< numbers of items
  alignas(64) std::atomic<std::uint64_t> shared_done;  ///< items whose shared contacts are done
};

/// Passes over the blocks, repeated until the residual is small. Each pass has one stage per color,
/// and each stage one item per part of the bodies. The items of a part run one after the other. An
/// item first solves the contacts that move a shared body, which contacts of other parts also move,
/// then the remaining contacts. Shared contacts of a stage wait for the shared contacts of all
/// earlier stages in conflicting parts. A thread runs the items of its part, so that they stay in
/// its caches. While it waits, it runs items of parts whose threads are absent or late. A waiting
/// thread has claimed no item and may leave.
struct RowSolver::Program {
  struct Pass {
    RowSweep sweep;
    const BlockRange* ranges;  ///< group g consists of shared blocks and other blocks
  };

  RowArrays arrays{};
  Pass passes[4];
  std::size_t pass_count = 0;
  std::uint64_t iterations = 0;        ///< all iterations, each of which includes the serial rows
  std::uint64_t block_iterations = 0;  ///< iterations that include the blocks
  SerialRows* serial = nullptr;
  Real threshold = -1;
  /// First iteration whose residual is exact. An earlier one is exact up to the threshold only.
  std::uint64_t exact_from = 0;
  std::atomic<Real>* residuals = nullptr;  ///< one per iteration
  std::uint64_t colors = 0;
  std::span<const std::uint64_t> conflicts{};  ///< by part: set of parts with common bodies
  std::span<PartProgress> parts{};
  std::atomic<std::uint64_t> absent{0};       ///< parts without a thread; all at the start
  std::atomic<std::uint64_t> serial_done{0};  ///< sweeps over the serial rows
  std::atomic<bool> broken{false};

  /// Runs the program together with the other threads that join.
  /// @param self the part of this thread; part 0 also solves the serial rows
  /// @return false if the backoff has reached its limit before the end
  bool join(std::uint32_t self, Backoff backoff) {
    const std::uint64_t stages = colors * pass_count;  // of an iteration
    for (std::uint64_t iteration = 0; iteration < iterations; ++iteration) {
      const std::uint64_t first = std::min(iteration, block_iterations) * stages;
      if (!wait_for_all(first, self, backoff)) return false;
      if (iteration > 0 && is_last(iteration - 1)) return true;
      if (!sweep_serial_rows(iteration, self, backoff)) return false;
      if (iteration >= block_iterations) continue;
      for (std::uint64_t stage = first; stage < first + stages; ++stage) {
        if (!complete(stage, self, backoff)) return false;
      }
    }
    return wait_for_all(std::min(iterations, block_iterations) * stages, self, backoff);
  }

  int iterations_done() const {
    if (iterations == 0) return 0;
    std::uint64_t i = 0;
    while (!is_last(i)) ++i;
    return static_cast<int>(i) + 1;
  }

 private:
  bool sweep_serial_rows(std::uint64_t iteration, std::uint32_t self, Backoff backoff) {
    if (serial == nullptr) return true;
    if (self == 0) {
      RowResidual residual;
      serial->sweep(static_cast<int>(iteration), &residual);
      note(residual, iteration);
      serial_done.store(iteration + 1, std::memory_order_release);
      return true;
    }
    while (serial_done.load(std::memory_order_acquire) <= iteration) {
      if (!backoff.wait()) return leave(self);
    }
    return true;
  }

  /// Completes an item of part `self`, or waits until another thread has completed it.
  bool complete(std::uint64_t stage, std::uint32_t self, Backoff backoff) {
    const PartProgress& part = parts[self];
    if (part.done.load(std::memory_order_acquire) > stage) return true;
    const std::uint64_t bit = std::uint64_t{1} << self;
    if ((absent.load(std::memory_order_relaxed) & bit) != 0) absent.fetch_and(~bit);
    for (std::uint64_t waits = 1; !run_next(self, stage + 1); ++waits) {
      if (part.done.load(std::memory_order_acquire) > stage) return true;
      if (!help_or_wait(stage, self, waits, &backoff)) return false;
    }
    return true;
  }

  /// Waits until all parts have completed this number of items.
  bool wait_for_all(std::uint64_t items, std::uint32_t self, Backoff backoff) {
    const auto is_done = [&](const PartProgress& part) {
      return part.done.load(std::memory_order_acquire) >= items;
    };
    for (std::uint64_t waits = 1; !std::all_of(parts.begin(), parts.end(), is_done); ++waits) {
      if (!help_or_wait(items, self, waits, &backoff)) return false;
    }
    return true;
  }

  /// Runs an item below `end` of a part whose thread is absent or, after some waits, late. If there
  /// is none, waits briefly.
  bool help_or_wait(std::uint64_t end, std::uint32_t self, std::uint64_t waits, Backoff* backoff) {
    const bool helps_late = waits % kWaitsForOthers == 0;
    const std::uint64_t missing = absent.load(std::memory_order_relaxed);
    if (helps_late || missing != 0) {
      for (std::uint32_t part = 0; part < parts.size(); ++part) {
        const std::uint64_t bit = std::uint64_t{1} << part;
        if (!helps_late && (missing & bit) == 0) continue;
        if (!run_next(part, end)) continue;
        absent.fetch_or(bit, std::memory_order_relaxed);
        backoff->reset();
        return true;
      }
    }
    return backoff->wait() || leave(self);
  }
  bool leave(std::uint32_t self) {
    absent.fetch_or(std::uint64_t{1} << self, std::memory_order_relaxed);
    return false;
  }

  /// Runs the next item of a part if it is below `end`, ready, and not claimed.
  bool run_next(std::uint32_t part, std::uint64_t end) {
    PartProgress& progress = parts[part];
    std::uint64_t item = progress.done.load(std::memory_order_acquire);
    if (item >= end || progress.claimed.load(std::memory_order_relaxed) != item) return false;
    const std::uint64_t pass = item / colors % pass_count, color = item % colors;
    const BlockRange* const blocks = passes[pass].ranges + 2 * (color * parts.size() + part);
    if (blocks[0].size() != 0 && !are_shared_done(conflicts[part], item)) return false;
    if (!progress.claimed.compare_exchange_strong(item, item + 1, std::memory_order_relaxed)) {
      return false;
    }
    const std::uint64_t iteration = item / (colors * pass_count);
    RowResidual residual{.largest = residuals[iteration].load(std::memory_order_relaxed),
                         .is_exact = iteration >= exact_from,
                         .enough = threshold};
    if (blocks[0].size() != 0)
      passes[pass].sweep(arrays, blocks[0].first, blocks[0].last, &residual);
    progress.shared_done.store(item + 1, std::memory_order_release);
    if (blocks[1].size() != 0)
      passes[pass].sweep(arrays, blocks[1].first, blocks[1].last, &residual);
    note(residual, iteration);
    progress.done.store(item + 1, std::memory_order_release);
    return true;
  }
  bool are_shared_done(std::uint64_t of_parts, std::uint64_t items) const {
    for (; of_parts != 0; of_parts &= of_parts - 1) {
      const PartProgress& part = parts[static_cast<std::size_t>(std::countr_zero(of_parts))];
      if (part.shared_done.load(std::memory_order_acquire) < items) return false;
    }
    return true;
  }

  void note(const RowResidual& residual, std::uint64_t iteration) {
    if (residual.broken) broken.store(true, std::memory_order_relaxed);
    std::atomic<Real>& largest = residuals[iteration];
    Real now = largest.load(std::memory_order_relaxed);
    while (residual.largest > now &&
           !largest.compare_exchange_weak(now, residual.largest, std::memory_order_relaxed)) {
    }
  }
  bool is_last(std::uint64_t iteration) const {
    return iteration + 1 == iterations ||
           residuals[iteration].load(std::memory_order_relaxed) <= threshold;
  }
};

RowSolver::~RowSolver() = default;

RowSolver::RowSolver(unsigned threads, SimdLevel simd)
    : kernels_(row_kernels(simd)), pool_(threads) {
  // The number of threads of the pool may grow later.
  most_parts_ = std::min(pool_.threads(), kMaxParts);
  progress_ = std::make_unique<PartProgress[]>(kPrograms * most_parts_);
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
  all_regular_ = true;
  coloring_.build(pairs, body_count_);
  pairs_ = pairs;
  choose_parts();
  const auto start = is_measured_ ? Clock::now() : Clock::time_point{};
  if (parts_ > 1) divide_bodies();
  if (is_measured_) division_us_ = us_since(start);
  const std::uint32_t lanes = kernels_.lanes;
  assign_groups();
  const std::size_t groups = group_count();
  ranges_.reserve(groups, "contacts of a solver");
  // The blocks of a part are consecutive, so that its thread sets them up.
  blocks_ = 0;
  for (std::size_t part = 0; part < parts_; ++part) {
    for (std::size_t color = 0; color < colors(); ++color) {
      for (std::size_t kind = 0; kind < 2; ++kind) {
        const std::size_t group = 2 * (color * parts_ + part) + kind;
        const std::uint32_t first = blocks_;
        std::uint32_t place = first * lanes;
        for (std::uint32_t k = 0; k < kKindsOfContacts; ++k) {
          place += std::exchange(next_lane_[kKindsOfContacts * group + k], place);
        }
        blocks_ = (place + lanes - 1) / lanes;
        ranges_[group] = {first, blocks_};
      }
    }
  }
  const std::size_t places = std::size_t{blocks_} * lanes;
  order_.reserve(places, "contacts of a solver");
  ids_.reserve(2 * places, "contacts of a solver");
  contacts_.reserve(places * rows::kContactFields, "rows of a solver");
  split_rows_.reserve(blocks_, "rows of a solver");
  frictions_.reserve(places * directions * rows::kFrictionFields, "rows of a solver");
  std::fill_n(order_.data(), places, kNoContact);
  std::fill_n(ids_.data(), 2 * places, rows::kFixedBody);
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    const std::uint32_t place = next_lane_[groups_[i]]++;
    order_[place] = static_cast<std::uint32_t>(i);
    std::int32_t* ids = ids_.data() + std::size_t{place / lanes} * 2 * lanes + place % lanes;
    ids[0] = slot_of_id(pairs[i].a);
    ids[lanes] = slot_of_id(pairs[i].b);
  }
}

/// Assigns a group to each contact: its color, the part of its first moving body, and whether it
/// moves a shared body. Counts the contacts of each group, and determines the conflicting parts.
void RowSolver::assign_groups() {
  groups_.reserve(pairs_.size(), "contacts of a solver");
  next_lane_.reserve(kKindsOfContacts * group_count(), "contacts of a solver");
  std::fill_n(next_lane_.data(), kKindsOfContacts * group_count(), 0u);
  const std::uint32_t* const colors = coloring_.colors_of_contacts();
  conflicts_.fill(0);
  if (parts_ == 1) {
    for (std::size_t i = 0; i < pairs_.size(); ++i) {
      ++next_lane_[groups_[i] = kKindsOfContacts * (2 * colors[i] + 1) + kind_of(pairs_[i])];
    }
    return;
  }
  mark_shared_bodies();
  for (std::size_t i = 0; i < pairs_.size(); ++i) {
    const RowPair& pair = pairs_[i];
    const std::uint32_t part = part_of(pair);
    std::uint64_t sharing = 0;
    for (const std::int32_t id : {pair.a, pair.b}) {
      const auto body = static_cast<std::size_t>(id);
      if (id >= 0 && (part_of_body_[body] & kIsShared) != 0) sharing |= parts_of_body_[body];
    }
    conflicts_[part] |= sharing & ~(std::uint64_t{1} << part);
    const std::uint32_t group = 2 * (colors[i] * parts_ + part) + (sharing != 0 ? 0 : 1);
    ++next_lane_[groups_[i] = kKindsOfContacts * group + kind_of(pair)];
  }
}

/// Marks the bodies that contacts of other parts move.
void RowSolver::mark_shared_bodies() {
  parts_of_body_.reserve(body_count_, "bodies of a solver");
  for (const RowPair& pair : pairs_) {
    if (pair.a < 0 || pair.b < 0) continue;
    const auto b = static_cast<std::size_t>(pair.b);
    const std::uint32_t part = part_of(pair), part_of_b = part_of_body_[b] & ~kIsShared;
    if (part == part_of_b) continue;
    if ((part_of_body_[b] & kIsShared) == 0) {
      part_of_body_[b] |= kIsShared;
      parts_of_body_[b] = std::uint64_t{1} << part_of_b;
    }
    parts_of_body_[b] |= std::uint64_t{1} << part;
  }
}

/// Selects either one part or as many threads as have kBlocksPerPart blocks of each color on
/// average.
void RowSolver::choose_parts() {
  const std::size_t blocks = pairs_.size() / kernels_.lanes;
  const std::size_t most =
      std::min(blocks / kBlocksPerThread, blocks / (kBlocksPerPart * std::max(colors(), 1u)));
  parts_ = static_cast<std::uint32_t>(std::clamp<std::size_t>(most, 1, std::size_t{most_parts_}));
  is_measured_ = parts_ > 1;
  if (is_measured_ && chooser_.choose(blocks) != kSeveralThreads) parts_ = 1;
}

/// Divides the bodies into parts of about equal numbers along the longest axis, so that few
/// contacts join bodies of two parts. The results do not depend on the parts.
void RowSolver::divide_bodies() {
  // Quantiles of a sample, because single bodies may be outliers.
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
  std::array<Real, kMaxParts> ends{};
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
  std::array<std::uint32_t, kMaxParts> next_slot{};
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
  return part_of_body_[static_cast<std::size_t>(body)] & ~kIsShared;
}

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
                                    const BlockIds& ids, const Real* inputs, Real* second) {
  const ContactSetup found =
      kernels_.set_up_contacts(settings, inputs, bodies_.data(), ids.data(), contact_rows(block),
                               friction_rows(block), second);
  split_rows_[block] = static_cast<std::uint8_t>(std::popcount(found.has_split));
  note_regular(found.is_regular);
  return found.has_second;
}
void RowSolver::set_up_frictions(const rows::RowSettings& settings, std::uint32_t block,
                                 const BlockIds& ids, std::uint32_t direction, const Real* inputs) {
  note_regular(kernels_.set_up_frictions(settings, inputs, bodies_.data(), ids.data(),
                                         friction_rows(block, direction)));
}

RowSweepReport RowSolver::solve(const RowSweepSettings& settings, bool with_factors) {
  const std::size_t factors = with_factors ? 1 : 0;
  std::uint64_t split_rows = 0;
  if (settings.split_impulse) {
    // Most contacts do not penetrate deeply enough for a split impulse: sweeps only the blocks that
    // contain such a contact.
    select(
        [&](std::uint32_t block) {
          split_rows += split_rows_[block];
          return split_rows_[block] > 0;
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
  for (std::size_t i = 0; i < kPrograms * parts_; ++i) {
    PartProgress& part = progress_[i];
    for (auto* count : {&part.claimed, &part.done, &part.shared_done}) *count = 0;
  }
  const auto add = [&](Program* program, RowSweep sweep, const BlockRange* ranges) {
    program->passes[program->pass_count++] = {sweep, ranges};
  };
  Program warm, split, main;
  PartProgress* next_progress = progress_.get();
  for (Program* program : {&warm, &split, &main}) {
    program->arrays = arrays;
    program->iterations = program->block_iterations = block_iterations;
    program->threshold = settings.threshold;
    program->colors = colors();
    program->conflicts = conflicts_;
    program->parts = {next_progress, parts_};
    program->absent = ~std::uint64_t{0} >> (kMaxParts - parts_);
    next_progress += parts_;
  }
  add(&warm, kernels_.warm_starts[factors], ranges_.data());
  warm.iterations = settings.warm_start ? 1 : 0;
  warm.residuals = residuals_.get() + 2 * iterations;
  add(&split, kernels_.split_impulses[factors], split_impulse_blocks_.ranges.data());
  split.iterations = split_rows > 0 ? block_iterations : 0;
  split.residuals = residuals_.get() + iterations;
  main.residuals = residuals_.get();
  main.iterations = iterations;
  if (all_regular_) {
    split.exact_from = split.iterations;
    main.exact_from = std::max<std::uint64_t>(iterations, 1) - 1;
  }
  main.serial = settings.serial;
  if (settings.interleave) {
    add(&main, kernels_.both[factors], ranges_.data());
  } else {
    add(&main, kernels_.contacts[factors], ranges_.data());
    add(&main, kernels_.frictions[factors], ranges_.data());
  }
  if (rolling_friction_blocks_.count > 0) {
    add(&main, kernels_.rolling_frictions[factors], rolling_friction_blocks_.ranges.data());
  }
  // The first participant always stays, so that the work is completed. Other participants leave
  // after a long wait: more threads than free processors only delay the working threads.
  const auto start = is_measured_ ? Clock::now() : Clock::time_point{};
  pool_.run(parts_, [&](std::size_t participant) {
    const auto self = static_cast<std::uint32_t>(participant);
    const Backoff backoff(self == 0);
    for (Program* program : {&warm, &split, &main}) {
      if (!program->join(self, backoff)) return;
    }
  });

  RowSweepReport report;
  report.iterations = main.iterations_done();
  if (is_measured_) {
    chooser_.record((division_us_ + us_since(start)) / (report.iterations + 1));
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
