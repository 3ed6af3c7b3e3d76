/// Implementation of ThreadPool: threads take chunks from counters that all of them can see.
#include "src/base/thread_pool.hpp"

#include <jfpx/error.hpp>

#include "src/base/atomic_wait.hpp"
#include "src/base/floating_point.hpp"
#include "src/base/pause.hpp"
#include "src/base/system.hpp"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <exception>
#include <mutex>
#include <new>
#include <string>
#include <system_error>
#include <thread>
#include <utility>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {

namespace {

using Clock = std::chrono::steady_clock;

/// Polls before a worker sleeps: some tens of microseconds.
constexpr unsigned kPolls = 2000;
/// Longer than most serial parts between two loops of a step of ten thousand bodies.
constexpr auto kLongWait = std::chrono::milliseconds(1);
/// If the time between two clock reads of a polling thread exceeds this, the thread was
/// descheduled.
constexpr auto kInterruption = std::chrono::microseconds(500);
/// Time after an interruption in which workers poll only briefly: longer polling would take cores
/// from threads with work.
constexpr auto kCrowded = std::chrono::milliseconds(50);
/// A count of chunks, and the number of their job or phase in the other bits.
constexpr unsigned kCountBits = 24;
constexpr std::uint64_t kCount = (std::uint64_t{1} << kCountBits) - 1;
/// Before this job number is exceeded, the process runs for a century.
constexpr std::uint64_t of_job(std::uint64_t number, std::uint64_t count) {
  return number << kCountBits | count;
}
constexpr std::uint64_t number_of(std::uint64_t value) { return value >> kCountBits; }
constexpr std::uint64_t count_of(std::uint64_t value) { return value & kCount; }
/// A thread takes this fraction of the remaining chunks, up to a limit: a descheduled thread delays
/// the loop by its portion.
constexpr std::uint64_t kPortionDivisor = 4, kLargestPortion = 8;
/// Up to this number of chunks a thread, a thread that has run its own chunks waits for some polls
/// before it takes those of others: looking at them takes longer than a short loop.
constexpr std::uint64_t kFewChunks = 2;
/// Polls of the caller; polls of a worker, and of a thread that waits for the end of a phase.
constexpr unsigned kPollsOfCaller = 16, kPollsBeforeHelp = 64;
/// Count of chunks of a job with phases.
constexpr std::uint64_t kHasPhases = kCount;

}  // namespace

/// Threads that run the loops of one or several pools, one loop at a time.
class ThreadPool::Workers : public std::enable_shared_from_this<Workers> {
 public:
  /// The workers of an existing pool of the calling thread with as many threads, or new workers,
  /// or, where the process has enough threads, those of a pool of another thread.
  /// @throws std::bad_alloc
  static std::shared_ptr<Workers> shared(unsigned threads);
  /// As many workers as `threads` requests, already acquired. Null if all are running loops, and
  /// the process has enough threads, or there is no memory for more.
  static std::shared_ptr<Workers> acquire_others(unsigned threads) noexcept;

  /// @param threads including the calling thread of run()
  /// @param starts_threads false: all other threads are those that call help()
  Workers(unsigned threads, bool starts_threads);
  ~Workers();
  Workers(const Workers&) = delete;
  Workers& operator=(const Workers&) = delete;

  /// Including the calling thread of run().
  unsigned threads() const noexcept { return thread_count_; }
  /// Number of threads that were requested.
  unsigned requested() const noexcept { return requested_; }

  /// Returns false if a loop is running.
  bool acquire() noexcept { return !busy_.exchange(true, std::memory_order_acquire); }
  void release() noexcept { busy_.store(false, std::memory_order_release); }
  /// Requires acquire(). @return the exception of the lowest chunk that threw one
  std::exception_ptr run(const Loop& loop);

  /// Whether threads may take part in a loop.
  bool may_share() const noexcept { return period_ != kNoPeriod || !workers_.empty(); }
  /// Begins a period in which help() takes part in the loops of this thread. @returns its number
  std::uint64_t begin_period() noexcept;
  void end_period() noexcept;
  /// Takes part in loops until the end of a period. Returns at once if the period has ended, or in
  /// the thread of the loops.
  void help(std::uint64_t period) noexcept;

 private:
  /// Part of a loop, limited to less than kCount chunks.
  struct Job {
    Loop loop;
    std::size_t first = 0;                 ///< number of the first chunk
    std::uint64_t number = 0;              ///< of the job, or of its first phase
    FloatingPointEnvironment environment;  ///< of the calling thread
  };
  /// Chunks of a thread.
  struct alignas(64) Chunks {
    /// Those that no thread has taken, as of_job(). The first thread that needs the value of a job
    /// sets it: the caller need not write to the caches of all threads.
    std::atomic<std::uint64_t> left{0};
    /// Those that this thread has completed, of any thread, as of_job(). Only the thread that has
    /// this item writes the value.
    alignas(64) std::atomic<std::uint64_t> done{0};
    /// The job with phases whose data this worker may read, or 0.
    std::atomic<std::uint64_t> joined{0};
    /// Whether a thread in help() has this item. The next one to have it may do so in the same job:
    /// a thread leaves a job when all of its chunks are taken, so that `done` is not overwritten.
    std::atomic<bool> is_taken{false};
  };

  static bool may_start(unsigned threads);
  static std::shared_ptr<Workers> start(unsigned threads);

  void run_job(const Job& job);
  void run_phases(const Job& job);
  std::uint64_t publish(const Job& job, std::uint64_t count);
  void join(unsigned self, std::uint64_t published);
  void take_phases(unsigned self, std::uint64_t number);
  void work(unsigned self);
  void take_part(unsigned self);
  unsigned take_place(std::uint64_t period);
  void wait_for_job(std::uint32_t* seen);
  void poll(std::uint32_t last);
  bool is_short(std::uint64_t job) const { return count_of(job) <= kFewChunks * thread_count_; }
  void take_chunks(unsigned self, std::uint64_t job);
  void take_chunks_of_others(unsigned self, std::uint64_t job, std::uint64_t* done);
  bool take_chunks_of(unsigned owner, unsigned self, std::uint64_t job, std::uint64_t* done);
  void run_chunks(std::uint64_t job, std::size_t first, std::uint64_t count);
  void report(unsigned self, std::uint64_t done);
  bool is_complete(std::uint64_t job) const;
  std::uint64_t first_chunk(std::uint64_t chunks, unsigned owner) const;

  /// Workers that pools may share.
  static constinit Workers* list_;
  /// Of list_. It is never destroyed, because pools may be static.
  static std::mutex& list_mutex();
  Workers* next_ = nullptr;
  std::thread::id creator_ = std::this_thread::get_id();

  unsigned requested_, thread_count_ = 1;
  unsigned polls_ = 0;                ///< number of polls before a worker sleeps
  std::unique_ptr<Chunks[]> chunks_;  ///< by thread; 0 is the caller
  std::atomic<bool> busy_{false};
  /// Since the epoch of the clock.
  std::atomic<Clock::duration> crowded_until_{Clock::duration::zero()};
  // What starts a job is in one cache line.
  alignas(64) std::atomic<std::uint64_t> published_{0};  ///< number and chunks of the last job
  std::atomic<std::uint32_t> number_{0};                 ///< low bits of the number, to wait for
  std::atomic<bool> stopped_{false};
  /// The current job. A thread may read it only between taking a chunk and reporting it, or after
  /// it has joined, because the next job overwrites it.
  Job job_;
  static constexpr std::uint64_t kNoPeriod = 0;
  std::atomic<std::uint64_t> period_{kNoPeriod};  ///< in which help() takes part
  std::atomic<std::thread::id> caller_;           ///< thread of the loops of the period
  std::uint64_t last_period_ = kNoPeriod;
  /// Whether the caller sleeps until all chunks are completed.
  alignas(64) std::atomic<std::uint32_t> caller_sleeps_{0};

  std::mutex error_mutex_;
  std::exception_ptr error_;
  std::size_t error_chunk_ = 0;
  std::vector<std::thread> workers_;
};

constinit ThreadPool::Workers* ThreadPool::Workers::list_ = nullptr;

std::mutex& ThreadPool::Workers::list_mutex() {
  alignas(std::mutex) static std::byte storage[sizeof(std::mutex)];
  static std::mutex& mutex = *new (storage) std::mutex;
  return mutex;
}

std::shared_ptr<ThreadPool::Workers> ThreadPool::Workers::shared(unsigned threads) {
  // Released after the lock, which the destructor of the workers takes.
  std::shared_ptr<Workers> of_others;
  const std::lock_guard lock(list_mutex());
  for (Workers* known = list_; known != nullptr; known = known->next_) {
    if (known->requested_ != threads) continue;
    const bool is_own = known->creator_ == std::this_thread::get_id();
    if (!is_own && (of_others != nullptr || may_start(threads))) continue;
    // Null if another thread is destroying the last pool.
    auto workers = known->weak_from_this().lock();
    if (is_own && workers != nullptr) return workers;
    if (!is_own) of_others = std::move(workers);
  }
  return of_others != nullptr ? of_others : start(threads);
}

std::shared_ptr<ThreadPool::Workers> ThreadPool::Workers::acquire_others(
    unsigned threads) noexcept {
  std::shared_ptr<Workers> found;  // released after the lock
  // In a child process, the lock may be that of a thread that does not exist there.
  const std::unique_lock lock(list_mutex(), std::try_to_lock);
  if (!lock.owns_lock()) return nullptr;
  for (Workers* known = list_; known != nullptr; known = known->next_) {
    if (known->requested_ != threads || known->busy_.load(std::memory_order_relaxed)) continue;
    found = known->weak_from_this().lock();
    if (found == nullptr) continue;
    return found->acquire() ? found : nullptr;
  }
  if (!may_start(threads)) return nullptr;
  try {
    found = start(threads);
  } catch (const std::bad_alloc&) {
    return nullptr;
  }
  found->acquire();
  return found;
}

/// Whether the process has too few threads for a request: as many as the largest request, or one
/// per core. More threads would only take the cores from each other.
bool ThreadPool::Workers::may_start(unsigned threads) {
  unsigned most = std::max(threads, usable_cores());
  unsigned started = 1;
  for (const Workers* known = list_; known != nullptr; known = known->next_) {
    most = std::max(most, known->requested_);
    started += known->thread_count_ - 1;
  }
  return started + threads - 1 <= most;
}

std::shared_ptr<ThreadPool::Workers> ThreadPool::Workers::start(unsigned threads) {
  auto workers = std::make_shared<Workers>(threads, true);
  workers->next_ = std::exchange(list_, workers.get());
  return workers;
}

ThreadPool::Workers::Workers(unsigned threads, bool starts_threads) : requested_(threads) {
  // A polling worker must not take the core of another thread.
  if (threads <= usable_cores()) polls_ = kPolls;
  chunks_ = std::make_unique<Chunks[]>(threads);
  if (!starts_threads) {
    thread_count_ = threads;
    return;
  }
  workers_.reserve(threads - 1);
  try {
    for (unsigned self = 1; self < threads; ++self) {
      workers_.emplace_back([this, self] { work(self); });
      ++thread_count_;
    }
  } catch (const std::exception&) {
    // Results do not depend on the number of threads, so the pool uses the threads that have
    // started.
  }
}

ThreadPool::Workers::~Workers() {
  {
    const std::lock_guard lock(list_mutex());
    for (Workers** known = &list_; *known != nullptr; known = &(*known)->next_) {
      if (*known != this) continue;
      *known = next_;
      break;
    }
  }
  stopped_ = true;
  ++number_;
  wake_all(number_);
  for (std::thread& worker : workers_) worker.join();
}

std::exception_ptr ThreadPool::Workers::run(const Loop& loop) {
  Job job;
  job.loop = loop;
  if (loop.phases > 0) run_phases(job);
  // Loops with more chunks than a job may have are split.
  constexpr std::size_t kMost = kCount - 1;
  for (; job.first < loop.chunks; job.first += kMost) {
    job.loop.chunks = std::min<std::size_t>(loop.chunks - job.first, kMost);
    run_job(job);
  }
  return std::exchange(error_, nullptr);
}

/// Starts the next job. @returns its number and `count`
std::uint64_t ThreadPool::Workers::publish(const Job& job, std::uint64_t count) {
  const std::uint64_t number = number_of(published_.load(std::memory_order_relaxed)) + 1;
  job_ = job;
  job_.number = number;
  const std::uint64_t published = of_job(number, count);
  published_.store(published, std::memory_order_release);
  number_.store(static_cast<std::uint32_t>(number));
  wake_all(number_);
  return published;
}

void ThreadPool::Workers::run_job(const Job& job) {
  const std::uint64_t published = publish(job, job.loop.chunks);
  std::uint64_t done = 0;
  take_chunks_of(0, 0, published, &done);
  bool has_helped = false;
  // Does not wait for workers without a chunk: on a loaded machine that would take longer than the
  // loop.
  for (unsigned i = 0; !is_complete(published); ++i) {
    if (!has_helped && (!is_short(published) || i >= std::min(polls_, kPollsOfCaller))) {
      take_chunks_of_others(0, published, &done);
      has_helped = true;
      continue;
    }
    if (i < polls_) {
      pause();
      continue;
    }
    caller_sleeps_.store(1);
    if (is_complete(published)) break;
    wait_while_equal(caller_sleeps_, 1);
  }
  caller_sleeps_.store(0, std::memory_order_relaxed);
}

/// Each phase has a number, as a job. The last one remains the number of the job.
void ThreadPool::Workers::run_phases(const Job& job) {
  const std::uint64_t number = number_of(publish(job, kHasPhases));
  take_phases(0, number);
  published_.store(of_job(number + job.loop.phases - 1, 0));
  for (unsigned worker = 1; worker < thread_count_; ++worker) {
    for (unsigned i = 0; chunks_[worker].joined.load() == number; ++i) {
      i < kPolls ? pause() : std::this_thread::yield();
    }
  }
}

/// Takes part in a job with phases, unless it has ended. The caller waits for workers that have
/// joined. @param published of the job
void ThreadPool::Workers::join(unsigned self, std::uint64_t published) {
  std::atomic<std::uint64_t>& joined = chunks_[self].joined;
  joined.store(number_of(published));
  if (published_.load() == published) take_phases(self, number_of(published));
  joined.store(0, std::memory_order_release);
}

/// @param number of the first phase
void ThreadPool::Workers::take_phases(unsigned self, std::uint64_t number) {
  const Loop& loop = job_.loop;
  for (std::size_t phase = 0; phase < loop.phases; ++phase) {
    const std::uint64_t chunks = loop.chunks_of(loop.body, phase);
    if (chunks == 0) continue;
    const std::uint64_t job = of_job(number + phase, chunks);
    std::uint64_t done = 0;
    take_chunks_of(self, self, job, &done);
    for (unsigned i = 0; !is_complete(job); ++i) {
      // A worker that has not joined has left its chunks.
      if (i == std::min(polls_, kPollsBeforeHelp)) take_chunks_of_others(self, job, &done);
      i < polls_ ? pause() : std::this_thread::yield();
    }
  }
}

void ThreadPool::Workers::work(unsigned self) {
  std::uint32_t seen = 0;
  for (wait_for_job(&seen); !stopped_; wait_for_job(&seen)) take_part(self);
}

/// Takes part in the last job that began, unless it has ended.
void ThreadPool::Workers::take_part(unsigned self) {
  const std::uint64_t published = published_.load(std::memory_order_acquire);
  if (count_of(published) == kHasPhases) {
    join(self, published);
  } else {
    take_chunks(self, published);
  }
}

std::uint64_t ThreadPool::Workers::begin_period() noexcept {
  caller_ = std::this_thread::get_id();
  period_ = ++last_period_;
  return last_period_;
}

/// A thread that waits for a job finds an empty one, and then the end of the period.
void ThreadPool::Workers::end_period() noexcept {
  period_ = kNoPeriod;
  publish({}, 0);
}

void ThreadPool::Workers::help(std::uint64_t period) noexcept {
  if (period_ != period || caller_.load() == std::this_thread::get_id()) return;
  const unsigned self = take_place(period);
  if (self == 0) return;
  const FloatingPointEnvironment environment;
  for (std::uint32_t seen = number_; period_ == period; wait_for_job(&seen)) take_part(self);
  environment.apply();
  chunks_[self].is_taken = false;
}

/// The number of a thread for the calling thread; 0 if the period has ended. There is one for each
/// task of a period, but threads of the last period may still have them for a short time.
unsigned ThreadPool::Workers::take_place(std::uint64_t period) {
  for (; period_ == period; std::this_thread::yield()) {
    for (unsigned self = 1; self < thread_count_; ++self) {
      if (!chunks_[self].is_taken.exchange(true)) return self;
    }
  }
  return 0;
}

/// @param seen number of the last job
void ThreadPool::Workers::wait_for_job(std::uint32_t* seen) {
  poll(*seen);
  wait_while_equal(number_, *seen);
  *seen = number_.load();
}

/// Polls until the next job begins, for a limited time. @param last number of the last job
void ThreadPool::Workers::poll(std::uint32_t last) {
  const auto begins = [&](unsigned polls) {
    for (unsigned i = 0; i < polls && number_.load() == last; ++i) pause();
    return number_.load() != last;
  };
  if (begins(polls_) || polls_ == 0) return;
  constexpr unsigned kPollsPerLook = 64;
  const auto start = Clock::now();
  if (start.time_since_epoch() < crowded_until_.load(std::memory_order_relaxed)) return;
  auto now = start;
  while (now - start < kLongWait && !begins(kPollsPerLook)) {
    const auto before = std::exchange(now, Clock::now());
    if (now - before < kInterruption) continue;
    crowded_until_.store((now + kCrowded).time_since_epoch(), std::memory_order_relaxed);
    return;
  }
}

/// The first chunk of a thread, among those of a job; for `owner` = thread_count_, their end.
std::uint64_t ThreadPool::Workers::first_chunk(std::uint64_t chunks, unsigned owner) const {
  return chunks * owner / thread_count_;
}

/// Whether all chunks of a job or phase are completed. A later phase begins after the end of this
/// one.
bool ThreadPool::Workers::is_complete(std::uint64_t job) const {
  std::uint64_t sum = 0;
  for (unsigned thread = 0; thread < thread_count_; ++thread) {
    const std::uint64_t done = chunks_[thread].done.load();
    if (number_of(done) > number_of(job)) return true;
    if (number_of(done) == number_of(job)) sum += count_of(done);
  }
  return sum == count_of(job);
}

/// Takes the chunks of worker `self`, then remaining chunks of other threads.
/// @param job number and chunks
void ThreadPool::Workers::take_chunks(unsigned self, std::uint64_t job) {
  std::uint64_t done = 0;
  if (!take_chunks_of(self, self, job, &done)) return;
  for (unsigned i = 0; is_short(job) && i < std::min(polls_, kPollsBeforeHelp); ++i) {
    if (number_of(published_.load(std::memory_order_relaxed)) != number_of(job)) return;
    pause();
  }
  take_chunks_of_others(self, job, &done);
}

void ThreadPool::Workers::take_chunks_of_others(unsigned self, std::uint64_t job,
                                                std::uint64_t* done) {
  for (unsigned i = 1; i < thread_count_; ++i) {
    if (!take_chunks_of((self + i) % thread_count_, self, job, done)) return;
  }
}

/// Takes a portion of the remaining chunks at a time, so that threads rarely access shared counters
/// and still end at the same time (guided self-scheduling, Polychronopoulos and Kuck 1987).
/// @param done number of chunks of the job that the thread has completed
/// @returns false if the job is completed, and another one has begun
bool ThreadPool::Workers::take_chunks_of(unsigned owner, unsigned self, std::uint64_t job,
                                         std::uint64_t* done) {
  const std::uint64_t end = first_chunk(count_of(job), owner + 1);
  const std::uint64_t all = end - first_chunk(count_of(job), owner);
  if (all == 0) return true;
  std::atomic<std::uint64_t>& value = chunks_[owner].left;
  for (std::uint64_t left_of_job = value.load();;) {
    if (number_of(left_of_job) > number_of(job)) return false;
    // The job is not completed while the value is that of an earlier one.
    const std::uint64_t left =
        number_of(left_of_job) == number_of(job) ? count_of(left_of_job) : all;
    if (left == 0) return true;
    const std::uint64_t taken =
        std::clamp<std::uint64_t>(left / kPortionDivisor, 1, kLargestPortion);
    if (!value.compare_exchange_weak(left_of_job, of_job(number_of(job), left - taken))) continue;
    // Worker threads have the environment of the caller.
    if (self > 0 && *done == 0) job_.environment.apply();
    run_chunks(job, end - left, taken);
    *done += taken;
    report(self, of_job(number_of(job), *done));
    left_of_job = value.load();
  }
}

/// @param job   number of the job or phase, and its chunks
/// @param first chunk of the job
void ThreadPool::Workers::run_chunks(std::uint64_t job, std::size_t first, std::uint64_t count) {
  first += job_.first;
  for (std::size_t chunk = first; chunk < first + count; ++chunk) {
    try {
      job_.loop.call(job_.loop.body, number_of(job) - job_.number, chunk);
    } catch (...) {
      const std::lock_guard lock(error_mutex_);
      if (!error_ || chunk < error_chunk_) {
        error_ = std::current_exception();
        error_chunk_ = chunk;
      }
    }
  }
}

/// Reports completed chunks. After the last one, the next job may begin at once and overwrite this
/// one.
void ThreadPool::Workers::report(unsigned self, std::uint64_t done) {
  chunks_[self].done.store(done);
  if (self == 0 || caller_sleeps_.load() == 0) return;
  caller_sleeps_.store(0);
  wake_one(caller_sleeps_);
}

void ThreadPool::check(unsigned threads) {
  if (threads <= kMaxThreads) return;
  throw InvalidArgument("threads is " + std::to_string(threads) +
                        "; it must be 0 (one per core) to " + std::to_string(kMaxThreads));
}

ThreadPool::ThreadPool(unsigned threads) : ThreadPool(threads, {}) {}
ThreadPool::ThreadPool(unsigned threads, EnqueueTask enqueue) : enqueue_(std::move(enqueue)) {
  check(threads);
  if (threads == 0) threads = std::min(usable_cores(), kMaxThreads);
  if (threads <= 1) return;
  workers_ = enqueue_ ? std::make_shared<Workers>(threads, false) : Workers::shared(threads);
}
ThreadPool::~ThreadPool() = default;

ThreadPool::Helpers::Helpers(const ThreadPool& pool) {
  if (pool.workers_ == nullptr || !pool.enqueue_) return;
  workers_ = pool.workers_;
  const std::uint64_t period = workers_->begin_period();
  try {
    for (unsigned i = 1; i < pool.threads(); ++i) {
      pool.enqueue_([workers = workers_, period] { workers->help(period); });
    }
  } catch (...) {
    workers_->end_period();
    throw;
  }
}
ThreadPool::Helpers::~Helpers() {
  if (workers_ != nullptr) workers_->end_period();
}

unsigned ThreadPool::threads() const noexcept {
  return workers_ == nullptr ? 1 : workers_->threads();
}

void ThreadPool::run_alone(const Loop& loop) {
  for (std::size_t phase = 0; phase < std::max<std::size_t>(loop.phases, 1); ++phase) {
    const std::size_t chunks = loop.phases > 0 ? loop.chunks_of(loop.body, phase) : loop.chunks;
    for (std::size_t i = 0; i < chunks; ++i) loop.call(loop.body, phase, i);
  }
}

void ThreadPool::run_shared(const Loop& loop) {
  if (!workers_->may_share()) return run_alone(loop);
  if (!workers_->acquire()) {
    if (enqueue_) return run_alone(loop);
    std::shared_ptr<Workers> others = Workers::acquire_others(workers_->requested());
    if (others == nullptr) return run_alone(loop);
    workers_ = std::move(others);
  }
  const std::exception_ptr error = workers_->run(loop);
  workers_->release();
  if (error) std::rethrow_exception(error);
}

}  // namespace JFPX_ABI
}  // namespace jfpx
