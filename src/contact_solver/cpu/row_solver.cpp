/// Scheduling of rows in blocks, and the threads that sweep over them; see the header.
#include "src/contact_solver/cpu/row_solver.hpp"

#include "src/base/cpu.hpp"
#include "src/base/pause.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <chrono>
#include <cmath>
#include <limits>
#include <thread>

namespace jfpx {
inline namespace JFPX_ABI {
namespace cpu {
namespace {

using Clock = std::chrono::steady_clock;

/// Blocks of a work item: about a microsecond of work, ten times the cost of claiming the item.
constexpr std::uint32_t kBlocksPerItem = 12;
/// Below this number of blocks, waking a second thread costs more than it saves.
constexpr std::uint32_t kBlocksPerThread = 64;
/// First of the two alternatives of the chooser; the other is one thread.
constexpr std::size_t kSeveralThreads = 0;
/// [us] Shorter than any sweep over a block, so that the chooser measures both alternatives.
constexpr double kLowerBoundBlockUs = 1e-4;

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

/// Bounded waiting for other threads, which may be waiting for a processor themselves: spins first,
/// then yields.
class Backoff {
 public:
  /// @param endless without it the wait ends after some tens of microseconds on a free processor,
  ///   and after some time slices of other threads on a busy one
  explicit Backoff(bool endless) : endless_(endless) {}

  /// Waits a moment. @return false when the limit is reached
  bool wait() {
    if (waits_ < kSpins) {
      pause();
    } else {
      if (!endless_ && waits_ >= kSpins + kYields) return false;
      std::this_thread::yield();
    }
    ++waits_;
    return true;
  }
  void reset() { waits_ = 0; }

 private:
  static constexpr std::uint64_t kSpins = 1000, kYields = 50;
  bool endless_;
  std::uint64_t waits_ = 0;
};

}  // namespace

/// Passes over the blocks, repeated until the residual is small. Work items are numbered through
/// all passes and iterations and claimed in order. A thread claims an item only when the item can
/// run immediately, so a waiting thread blocks no other one and may leave.
struct RowSolver::Program {
  struct Pass {
    RowSweep sweep;
    const WorkItem* items;
    std::uint64_t item_count;
  };

  RowArrays arrays{};
  Pass passes[3];
  std::size_t pass_count = 0;
  std::uint64_t iterations = 0;        ///< iterations of the serial rows and of all
  std::uint64_t block_iterations = 0;  ///< iterations that include the blocks
  SerialRows* serial = nullptr;
  Real threshold = -1;
  std::atomic<Real>* residuals = nullptr;  ///< one per iteration
  std::atomic<std::uint64_t> next{0}, done{0};
  std::atomic<bool> broken{false}, ended{false};

  /// The serial rows are one work item, the first of an iteration.
  std::uint64_t serial_items() const { return serial == nullptr ? 0 : 1; }
  std::uint64_t items_per_iteration() const {
    std::uint64_t count = serial_items();
    for (std::size_t i = 0; i < pass_count; ++i) count += passes[i].item_count;
    return count;
  }
  void add(RowSweep sweep, const WorkItem* list, std::uint64_t count) {
    passes[pass_count++] = {sweep, list, count};
  }

  /// Runs work items until none is left. @return false if the backoff reached its limit before
  bool join(Backoff backoff) {
    const std::uint64_t per_iteration = items_per_iteration();
    std::uint64_t number = next.load(std::memory_order_relaxed);
    for (;;) {
      const std::uint64_t iteration = per_iteration == 0 ? iterations : number / per_iteration;
      if (iteration >= iterations) return true;
      const std::uint64_t start = iteration * per_iteration;
      const Task task = task_of(number - start, iteration);
      if (done.load(std::memory_order_acquire) < start + task.after) {
        if (ended.load(std::memory_order_relaxed)) return true;
        if (!backoff.wait()) return false;
        number = next.load(std::memory_order_relaxed);
        continue;
      }
      if (iteration > 0 && is_last(iteration - 1)) ended.store(true, std::memory_order_relaxed);
      if (ended.load(std::memory_order_relaxed)) return true;
      if (!next.compare_exchange_weak(number, number + 1, std::memory_order_relaxed)) continue;
      backoff.reset();
      RowResidual residual;
      if (task.sweep != nullptr) {
        task.sweep(arrays, task.first, task.last, &residual);
      } else if (task.is_serial) {
        serial->sweep(static_cast<int>(iteration), &residual);
      }
      if (residual.broken) broken.store(true, std::memory_order_relaxed);
      raise(residuals + iteration, residual.largest);
      done.fetch_add(1, std::memory_order_release);
      ++number;
    }
  }
  bool is_done() const {
    return done.load(std::memory_order_acquire) >= iterations * items_per_iteration();
  }

  /// The task of a work item. It may begin when the first `after` items of its iteration, and all
  /// items of earlier iterations, are done.
  struct Task {
    RowSweep sweep = nullptr;
    bool is_serial = false;
    std::uint32_t first = 0, last = 0;
    std::uint64_t after = 0;
  };
  Task task_of(std::uint64_t number, std::uint64_t iteration) const {
    if (number < serial_items()) return {.is_serial = true};
    std::uint64_t start = serial_items();
    const Pass* pass = passes;
    for (; number - start >= pass->item_count; ++pass) start += pass->item_count;
    const WorkItem& item = pass->items[number - start];
    return {.sweep = iteration < block_iterations ? pass->sweep : nullptr,
            .first = item.first,
            .last = item.last,
            .after = start + item.after};
  }
  bool is_last(std::uint64_t iteration) const {
    return iteration + 1 == iterations ||
           residuals[iteration].load(std::memory_order_relaxed) <= threshold;
  }
  int iterations_done() const {
    if (iterations == 0) return 0;
    std::uint64_t i = 0;
    while (!is_last(i)) ++i;
    return static_cast<int>(i) + 1;
  }
  static void raise(std::atomic<Real>* value, Real to) {
    Real now = value->load(std::memory_order_relaxed);
    while (to > now && !value->compare_exchange_weak(now, to, std::memory_order_relaxed)) {
    }
  }
};

RowSolver::RowSolver(unsigned threads, SimdLevel simd)
    : kernels_(row_kernels(simd)), pool_(threads) {}

void RowSolver::resize_bodies(std::size_t count) {
  bodies_.reserve(count * rows::kBodyFields, "bodies of a solver", body_count_ * rows::kBodyFields);
  velocities_.reserve(count * rows::kVelocityFields, "velocities of a solver",
                      body_count_ * rows::kVelocityFields);
  push_velocities_.reserve(count * rows::kVelocityFields, "velocities of a solver",
                           body_count_ * rows::kVelocityFields);
  factors_.reserve(count * rows::kFactorFields, "factors of a solver",
                   body_count_ * rows::kFactorFields);
  body_count_ = count;
  std::fill_n(body(0), rows::kBodyFields, Real(0));
  std::fill_n(velocity(0), rows::kVelocityFields, Real(0));
  std::fill_n(push_velocity(0), rows::kVelocityFields, Real(0));
  std::fill_n(factors(0), rows::kFactorFields, Real(0));
}

void RowSolver::schedule(std::span<const RowPair> pairs, std::uint32_t directions) {
  directions_ = directions;
  rolling_friction_blocks_.count = rolling_friction_blocks_.item_count = 0;
  const std::uint32_t lanes = kernels_.lanes;
  coloring_.build(pairs, body_count_);
  next_lane_.reserve(pairs.size(), "contacts of a solver");
  color_end_.reserve(pairs.size(), "contacts of a solver");
  blocks_ = 0;
  for (std::uint32_t color = 0; color < coloring_.colors(); ++color) {
    next_lane_[color] = blocks_ * lanes;
    blocks_ += (coloring_.contacts_of(color) + lanes - 1) / lanes;
    color_end_[color] = blocks_;
  }
  const std::size_t slots = std::size_t{blocks_} * lanes;
  order_.reserve(slots, "contacts of a solver");
  ids_.reserve(2 * slots, "contacts of a solver");
  contacts_.reserve(slots * rows::kContactFields, "rows of a solver");
  frictions_.reserve(slots * directions * rows::kFrictionFields, "rows of a solver");
  std::fill_n(order_.data(), slots, kNoContact);
  std::fill_n(ids_.data(), 2 * slots, rows::kFixedBody);
  const std::uint32_t* const colors = coloring_.colors_of_contacts();
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    const std::uint32_t slot = next_lane_[colors[i]]++;
    order_[slot] = static_cast<std::uint32_t>(i);
    std::int32_t* ids = ids_.data() + std::size_t{slot / lanes} * 2 * lanes + slot % lanes;
    ids[0] = pairs[i].a;
    ids[lanes] = pairs[i].b;
  }
  make_work_items({color_end_.data(), coloring_.colors()}, &items_, &item_count_);
}

// Large colors are split, so that threads share them. A run of small colors becomes one work item,
// because one thread completes them sooner than several threads that wait for each other.
void RowSolver::make_work_items(std::span<const std::uint32_t> color_ends, Buffer<WorkItem>* items,
                                std::uint32_t* count) {
  const std::uint32_t total = color_ends.empty() ? 0 : color_ends.back();
  items->reserve(total, "work items of a solver");
  *count = 0;
  const auto add = [&](std::uint32_t first, std::uint32_t last, std::uint32_t after) {
    (*items)[(*count)++] = {first, last, after};
  };
  std::uint32_t first = 0, begin = 0;  // of the run of small colors; of the color
  const auto flush = [&](std::uint32_t end) {
    if (first < end) add(first, end, *count);
  };
  for (const std::uint32_t end : color_ends) {
    if (end - begin > kBlocksPerItem) {
      flush(begin);
      const std::uint32_t after = *count;
      for (std::uint32_t i = begin; i < end; i += kBlocksPerItem) {
        add(i, std::min(end, i + kBlocksPerItem), after);
      }
      first = end;
    } else if (end - first >= kBlocksPerItem) {
      flush(end);
      first = end;
    }
    begin = end;
  }
  flush(total);
}

/// The number of threads that can work concurrently: at most the average number of work items that
/// do not depend on each other.
unsigned RowSolver::useful_threads() const {
  std::uint32_t stages = 0;
  for (std::uint32_t i = 0; i < item_count_; ++i) {
    if (i == 0 || items_[i].after != items_[i - 1].after) ++stages;
  }
  const std::uint32_t concurrent = item_count_ / std::max(stages, 1u);
  return std::clamp(std::min(concurrent, blocks_ / kBlocksPerThread), 1u, pool_.threads());
}

unsigned RowSolver::set_up_contacts(const rows::RowSettings& settings, std::uint32_t block,
                                    const Real* inputs, Real* second) {
  return kernels_.set_up_contacts(settings, inputs, bodies_.data(),
                                  ids_.data() + std::size_t{block} * 2 * kernels_.lanes,
                                  contact_rows(block), friction_rows(block), second);
}
void RowSolver::set_up_frictions(const rows::RowSettings& settings, std::uint32_t block,
                                 std::uint32_t direction, const Real* inputs) {
  kernels_.set_up_frictions(settings, inputs, bodies_.data(),
                            ids_.data() + std::size_t{block} * 2 * kernels_.lanes,
                            friction_rows(block, direction));
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
  Program warm, split, main;
  for (Program* program : {&warm, &split, &main}) {
    program->arrays = arrays;
    program->iterations = program->block_iterations = block_iterations;
    program->threshold = settings.threshold;
  }
  warm.add(kernels_.warm_starts[factors], items_.data(), item_count_);
  warm.iterations = settings.warm_start ? 1 : 0;
  warm.residuals = residuals_.get() + 2 * iterations;
  split.add(kernels_.split_impulses[factors], split_impulse_blocks_.items.data(),
            split_impulse_blocks_.item_count);
  split.iterations = split_rows > 0 ? block_iterations : 0;
  split.residuals = residuals_.get() + iterations;
  main.residuals = residuals_.get();
  main.iterations = iterations;
  main.serial = settings.serial;
  if (settings.interleave) {
    main.add(kernels_.both[factors], items_.data(), item_count_);
  } else {
    main.add(kernels_.contacts[factors], items_.data(), item_count_);
    main.add(kernels_.frictions[factors], items_.data(), item_count_);
  }
  main.add(kernels_.rolling_frictions[factors], rolling_friction_blocks_.items.data(),
           rolling_friction_blocks_.item_count);
  // The first participant always stays, so that the work is completed. The others leave when they
  // wait for long: then there are more threads than free processors, and they only take time from
  // the threads that work.
  const unsigned most = useful_threads();
  TimeChooser& chooser = thread_choosers_[std::bit_width(blocks_)];
  const auto predicted_us = [&](int sweeps) {
    return kLowerBoundBlockUs * static_cast<double>(blocks_) * (sweeps + 1);
  };
  unsigned threads = 1;
  if (most > 1) {
    const double us = predicted_us(settings.iterations);
    if (chooser.choose(blocks_, std::array{us, us}).alternative == kSeveralThreads) threads = most;
  }
  const auto start = most > 1 ? Clock::now() : Clock::time_point{};
  pool_.run(threads, [&](std::size_t participant) {
    Backoff backoff(participant == 0);
    if (!warm.join(backoff) || !split.join(backoff)) return;
    while (!warm.is_done()) {
      if (!backoff.wait()) return;
    }
    main.join(backoff);
  });

  RowSweepReport report;
  report.iterations = main.iterations_done();
  if (most > 1) {
    const std::chrono::duration<double, std::micro> us = Clock::now() - start;
    chooser.record(us.count(), predicted_us(report.iterations));
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
