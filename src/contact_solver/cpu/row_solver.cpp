/// Scheduling and running the sweeps; see the header.
#include "src/contact_solver/cpu/row_solver.hpp"

#include "src/base/cpu.hpp"

#include <algorithm>
#include <bit>
#include <chrono>
#include <cmath>
#include <limits>

namespace jfpx {
inline namespace JFPX_ABI {
namespace cpu {
namespace {

using Clock = std::chrono::steady_clock;

/// Blocks that a thread takes at a time: about a microsecond's work, ten times what taking costs.
constexpr std::uint32_t kTicketBlocks = 12;
/// With fewer blocks than this waking a second thread costs more than it helps.
constexpr std::uint32_t kBlocksPerThread = 64;

const RowKernels& row_kernels(SimdLevel simd) {
  return usable_simd_level(simd) >= SimdLevel::avx2 ? kAvx2RowKernels : kScalarRowKernels;
}

bool all_finite(const Real* values, std::size_t count) {
  bool finite = true;
  for (std::size_t i = 0; i < count; ++i) {
    finite &= std::abs(values[i]) <= std::numeric_limits<Real>::max();
  }
  return finite;
}

/// How long to wait for other threads, which may have to wait for a processor themselves.
class Patience {
 public:
  /// @param endless else it ends after some tens of microseconds on processors that are free, and
  /// after some time slices of others on those that are not
  explicit Patience(bool endless) : endless_(endless) {}

  /// Waits a moment; false once it has ended.
  bool wait() {
    if (waits_ < kSpins) {
      __builtin_ia32_pause();
    } else {
      if (!endless_ && waits_ >= kSpins + kYields) return false;
      std::this_thread::yield();
    }
    ++waits_;
    return true;
  }
  void renew() { waits_ = 0; }

 private:
  static constexpr std::uint64_t kSpins = 1000, kYields = 50;
  bool endless_;
  std::uint64_t waits_ = 0;
};

}  // namespace

/// Passes over the blocks, repeated until the residual is small. Tickets are numbered through all
/// passes and iterations, and taken in order. A ticket is taken when it can be run at once: so
/// those who wait hold up nobody, and may leave.
struct RowSolver::Program {
  struct Pass {
    RowSweep sweep;
    const Ticket* tickets;
    std::uint64_t ticket_count;
  };

  RowArrays arrays;
  Pass passes[3];
  std::size_t pass_count = 0;
  std::uint64_t iterations = 0;        ///< with the serial rows
  std::uint64_t block_iterations = 0;  ///< with the blocks
  SerialRows* serial = nullptr;
  Real threshold = -1;
  std::atomic<Real>* residuals = nullptr;  ///< one an iteration
  std::atomic<std::uint64_t> next{0}, done{0};
  std::atomic<bool> broken{false}, ended{false};

  /// The serial rows are one ticket, the first.
  std::uint64_t serial_tickets() const { return serial == nullptr ? 0 : 1; }
  std::uint64_t tickets_an_iteration() const {
    std::uint64_t count = serial_tickets();
    for (std::size_t i = 0; i < pass_count; ++i) count += passes[i].ticket_count;
    return count;
  }
  void add(RowSweep sweep, const Ticket* list, std::uint64_t count) {
    passes[pass_count++] = {sweep, list, count};
  }

  /// Takes tickets until there are none; false if patience has ended before.
  bool join(Patience patience) {
    const std::uint64_t per_iteration = tickets_an_iteration();
    std::uint64_t number = next.load(std::memory_order_relaxed);
    for (;;) {
      const std::uint64_t iteration = per_iteration == 0 ? iterations : number / per_iteration;
      if (iteration >= iterations) return true;
      const std::uint64_t start = iteration * per_iteration;
      const Work work = work_of(number - start, iteration);
      if (done.load(std::memory_order_acquire) < start + work.after) {
        if (ended.load(std::memory_order_relaxed)) return true;
        if (!patience.wait()) return false;
        number = next.load(std::memory_order_relaxed);
        continue;
      }
      if (iteration > 0 && is_last(iteration - 1)) ended.store(true, std::memory_order_relaxed);
      if (ended.load(std::memory_order_relaxed)) return true;
      if (!next.compare_exchange_weak(number, number + 1, std::memory_order_relaxed)) continue;
      patience.renew();
      RowResidual residual;
      if (work.sweep != nullptr) {
        work.sweep(arrays, work.first, work.last, &residual);
      } else if (work.is_serial) {
        serial->sweep(static_cast<int>(iteration), &residual);
      }
      if (residual.broken) broken.store(true, std::memory_order_relaxed);
      raise(residuals + iteration, residual.largest);
      done.fetch_add(1, std::memory_order_release);
      ++number;
    }
  }
  bool is_done() const {
    return done.load(std::memory_order_acquire) >= iterations * tickets_an_iteration();
  }

  /// What a ticket asks for. It may begin when the `after` tickets of its iteration before it, and
  /// all of earlier iterations, are done.
  struct Work {
    RowSweep sweep = nullptr;
    bool is_serial = false;
    std::uint32_t first = 0, last = 0;
    std::uint64_t after = 0;
  };
  Work work_of(std::uint64_t number, std::uint64_t iteration) const {
    if (number < serial_tickets()) return {.is_serial = true};
    std::uint64_t start = serial_tickets();
    const Pass* pass = passes;
    for (; number - start >= pass->ticket_count; ++pass) start += pass->ticket_count;
    const Ticket& ticket = pass->tickets[number - start];
    return {.sweep = iteration < block_iterations ? pass->sweep : nullptr,
            .first = ticket.first,
            .last = ticket.last,
            .after = start + ticket.after};
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
  pushes_.reserve(count * rows::kVelocityFields, "velocities of a solver",
                  body_count_ * rows::kVelocityFields);
  factors_.reserve(count * rows::kFactorFields, "factors of a solver",
                   body_count_ * rows::kFactorFields);
  body_count_ = count;
  std::fill_n(body(0), rows::kBodyFields, Real(0));
  std::fill_n(velocity(0), rows::kVelocityFields, Real(0));
  std::fill_n(push(0), rows::kVelocityFields, Real(0));
  std::fill_n(factors(0), rows::kFactorFields, Real(0));
}

// A contact's level is one more than the highest of those before it that move one of its bodies.
// Rows of a level are independent, and level by level is an order that keeps each body's.
void RowSolver::schedule(std::span<const RowPair> pairs, std::uint32_t directions) {
  directions_ = directions;
  rolling_friction_choice_.count = rolling_friction_choice_.ticket_count = 0;
  const auto slot = [](std::int32_t id) { return static_cast<std::size_t>(id); };
  const std::uint32_t lanes = kernels_.lanes;
  contact_level_.reserve(pairs.size(), "contacts of a solver");
  level_count_.reserve(pairs.size(), "contacts of a solver");
  level_end_.reserve(pairs.size(), "contacts of a solver");
  body_level_.reserve(body_count_, "bodies of a solver");
  std::fill_n(body_level_.data(), body_count_, 0u);
  levels_ = 0;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    const auto [a, b] = pairs[i];
    std::uint32_t level = 0;
    if (a >= 0) level = body_level_[slot(a)];
    if (b >= 0) level = std::max(level, body_level_[slot(b)]);
    if (a >= 0) body_level_[slot(a)] = level + 1;
    if (b >= 0) body_level_[slot(b)] = level + 1;
    contact_level_[i] = level;
    if (level == levels_) level_count_[levels_++] = 0;
    ++level_count_[level];
  }
  blocks_ = 0;
  for (std::uint32_t level = 0; level < levels_; ++level) {
    const std::uint32_t first = blocks_;
    blocks_ += (level_count_[level] + lanes - 1) / lanes;
    level_end_[level] = blocks_;
    level_count_[level] = first * lanes;  // from here on: the level's next free lane
  }
  const std::size_t places = std::size_t{blocks_} * lanes;
  order_.reserve(places, "contacts of a solver");
  ids_.reserve(2 * places, "contacts of a solver");
  contacts_.reserve(places * rows::kContactFields, "rows of a solver");
  frictions_.reserve(places * directions * rows::kFrictionFields, "rows of a solver");
  std::fill_n(order_.data(), places, kNoContact);
  std::fill_n(ids_.data(), 2 * places, rows::kFixedBody);
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    const std::uint32_t place = level_count_[contact_level_[i]]++;
    order_[place] = static_cast<std::uint32_t>(i);
    std::int32_t* ids = ids_.data() + std::size_t{place / lanes} * 2 * lanes + place % lanes;
    ids[0] = pairs[i].a;
    ids[lanes] = pairs[i].b;
  }
  make_tickets({level_end_.data(), levels_}, &tickets_, &ticket_count_);
}

// Long levels are cut, so that threads share them; a run of short levels becomes one ticket,
// because one thread alone is done with them sooner than several that wait for each other.
void RowSolver::make_tickets(std::span<const std::uint32_t> level_ends, Buffer<Ticket>* tickets,
                             std::uint32_t* count) {
  const std::uint32_t total = level_ends.empty() ? 0 : level_ends.back();
  tickets->reserve(total, "tickets of a solver");
  *count = 0;
  const auto add = [&](std::uint32_t first, std::uint32_t last, std::uint32_t after) {
    (*tickets)[(*count)++] = {first, last, after};
  };
  std::uint32_t first = 0, begin = 0;  // of the run of short levels; of the level
  const auto flush = [&](std::uint32_t end) {
    if (first < end) add(first, end, *count);
  };
  for (const std::uint32_t end : level_ends) {
    if (end - begin > kTicketBlocks) {
      flush(begin);
      const std::uint32_t after = *count;
      for (std::uint32_t i = begin; i < end; i += kTicketBlocks) {
        add(i, std::min(end, i + kTicketBlocks), after);
      }
      first = end;
    } else if (end - first >= kTicketBlocks) {
      flush(end);
      first = end;
    }
    begin = end;
  }
  flush(total);
}

/// Threads that find something to do at the same time: no more than a level has tickets on average.
unsigned RowSolver::useful_threads() const {
  std::uint32_t stages = 0;
  for (std::uint32_t i = 0; i < ticket_count_; ++i) {
    if (i == 0 || tickets_[i].after != tickets_[i - 1].after) ++stages;
  }
  const std::uint32_t at_once = ticket_count_ / std::max(stages, 1u);
  return std::clamp(std::min(at_once, blocks_ / kBlocksPerThread), 1u, pool_.threads());
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
  std::uint64_t pushing = 0;
  if (settings.push) {
    // Most contacts are not deep enough to be pushed apart: only blocks with one that is are swept.
    choose(
        [&](std::uint32_t block) {
          const Real* rhs = contact_rows(block) + std::size_t{rows::kRowPushRhs} * kernels_.lanes;
          const auto here = std::count_if(rhs, rhs + kernels_.lanes, [](Real r) { return r != 0; });
          pushing += static_cast<std::uint64_t>(here);
          return here > 0;
        },
        &push_choice_);
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
                   .pushes = pushes_.data(),
                   .factors = with_factors ? factors_.data() : nullptr,
                   .contacts = contacts_.data(),
                   .frictions = frictions_.data(),
                   .directions = directions_,
                   .push_blocks = push_choice_.blocks.data(),
                   .rolling_friction_blocks = rolling_friction_choice_.blocks.data(),
                   .rolling_frictions = rolling_frictions_.data()};
  Program warm, push, main;
  for (Program* program : {&warm, &push, &main}) {
    program->arrays = arrays;
    program->iterations = program->block_iterations = block_iterations;
    program->threshold = settings.threshold;
  }
  warm.add(kernels_.warm_starts[factors], tickets_.data(), ticket_count_);
  warm.iterations = settings.warm_start ? 1 : 0;
  warm.residuals = residuals_.get() + 2 * iterations;
  push.add(kernels_.pushes[factors], push_choice_.tickets.data(), push_choice_.ticket_count);
  push.iterations = pushing > 0 ? block_iterations : 0;
  push.residuals = residuals_.get() + iterations;
  main.residuals = residuals_.get();
  main.iterations = iterations;
  main.serial = settings.serial;
  if (settings.interleave) {
    main.add(kernels_.both[factors], tickets_.data(), ticket_count_);
  } else {
    main.add(kernels_.contacts[factors], tickets_.data(), ticket_count_);
    main.add(kernels_.frictions[factors], tickets_.data(), ticket_count_);
  }
  main.add(kernels_.rolling_frictions[factors], rolling_friction_choice_.tickets.data(),
           rolling_friction_choice_.ticket_count);
  // The first stays whatever happens, so that somebody ends the work. Others leave when they are
  // kept waiting: then there are more threads than processors for them, and they are in the way.
  const unsigned most = useful_threads();
  ThreadChoice& choice = thread_choices_[std::bit_width(blocks_)];
  const auto start = most > 1 ? Clock::now() : Clock::time_point{};
  pool_.run(choice.several() ? most : 1, [&](std::size_t participant) {
    Patience patience(participant == 0);
    if (!warm.join(patience) || !push.join(patience)) return;
    while (!warm.is_done()) {
      if (!patience.wait()) return;
    }
    main.join(patience);
  });

  RowSweepReport report;
  report.iterations = main.iterations_done();
  if (most > 1) {
    const std::chrono::duration<double> taken = Clock::now() - start;
    choice.record(taken.count() / (static_cast<double>(blocks_) * (report.iterations + 1)));
  }
  if (report.iterations > 0) {
    report.residual = residuals_[static_cast<std::size_t>(report.iterations) - 1];
  }
  report.pushed = pushing * static_cast<std::uint64_t>(push.iterations_done());
  const std::size_t numbers = body_count_ * rows::kVelocityFields;
  report.broken = main.broken || push.broken || !all_finite(velocities_.data(), numbers) ||
                  !all_finite(pushes_.data(), numbers);
  return report;
}

}  // namespace cpu
}  // namespace JFPX_ABI
}  // namespace jfpx
