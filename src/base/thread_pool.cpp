/// Implementation of ThreadPool: threads take chunks from a shared counter.
#include "src/base/thread_pool.hpp"

#include <jfpx/error.hpp>

#include "src/base/pause.hpp"

#include <algorithm>
#include <string>
#include <system_error>
#include <utility>

namespace jfpx {
inline namespace JFPX_ABI {

namespace {

/// Some tens of microseconds, more than most serial parts between two loops of a step.
constexpr unsigned kPolls = 2000;
constexpr std::uint64_t kChunksLeft = 0xffffffffu;

}  // namespace

void ThreadPool::check(unsigned threads) {
  if (threads <= kMaxThreads) return;
  throw InvalidArgument("threads is " + std::to_string(threads) +
                        "; it must be 0 (one per core) to " + std::to_string(kMaxThreads));
}

ThreadPool::ThreadPool(unsigned threads) {
  check(threads);
  if (threads == 0) threads = std::clamp(std::thread::hardware_concurrency(), 1u, kMaxThreads);
  // A worker that polls must not take the core of another thread.
  if (threads <= std::thread::hardware_concurrency()) polls_ = kPolls;
  tickets_ = std::make_unique<Ticket[]>(threads);
  workers_.reserve(threads - 1);
  try {
    for (unsigned self = 1; self < threads; ++self) {
      workers_.emplace_back([this, self](const std::stop_token& stop) { work(stop, self); });
      ++thread_count_;
    }
  } catch (const std::system_error&) {
    // Results do not depend on the number of threads, so the pool works with those that started.
  }
}

ThreadPool::~ThreadPool() {
  for (std::jthread& worker : workers_) worker.request_stop();
}

void ThreadPool::run_shared(Job job) {
  std::fegetenv(&job.environment);
  constexpr std::size_t kMaxChunks = 0xffffffffu;
  // Loops over more chunks than a ticket can count run in parts.
  const Job whole = job;
  for (std::size_t first = 0; first < whole.chunks; first += kMaxChunks) {
    job.first = first;
    job.chunks = std::min(whole.chunks - first, kMaxChunks);
    run_part(job);
  }
  if (error_) std::rethrow_exception(std::exchange(error_, nullptr));
}

void ThreadPool::run_part(const Job& job) {
  job_ = job;
  done_.store(0, std::memory_order_relaxed);
  const std::uint32_t loop = loop_.load(std::memory_order_relaxed) + 1;
  for (unsigned owner = 0; owner < thread_count_; ++owner) {
    const std::uint64_t chunks = first_chunk(owner + 1) - first_chunk(owner);
    tickets_[owner].value.store(std::uint64_t{loop} << 32 | chunks, std::memory_order_release);
  }
  loop_.store(loop);
  if (sleepers_.load() > 0) {
    // A worker between its last look at the loop and its wait holds the mutex.
    { const std::lock_guard lock(mutex_); }
    started_.notify_all();
  }
  take_chunks(0);
  // Workers that have taken no chunk are not waited for: on a loaded machine that would take longer
  // than the loop.
  const auto chunks = static_cast<std::uint32_t>(job.chunks);
  for (unsigned i = 0;; ++i) {
    const std::uint32_t done = done_.load(std::memory_order_acquire);
    if (done == chunks) return;
    if (i < polls_) {
      pause();
    } else {
      done_.wait(done, std::memory_order_acquire);
    }
  }
}

void ThreadPool::work(const std::stop_token& stop, unsigned self) {
  std::uint32_t seen = 0;
  while (wait_for_loop(stop, &seen)) take_chunks(self);
}

/// Returns false if the pool is being destroyed. @param seen number of the last loop
bool ThreadPool::wait_for_loop(const std::stop_token& stop, std::uint32_t* seen) {
  const auto is_new = [&] {
    const std::uint32_t loop = loop_.load();
    if (loop == *seen) return false;
    *seen = loop;
    return true;
  };
  for (unsigned i = 0; i < polls_; ++i) {
    if (is_new()) return true;
    if (stop.stop_requested()) return false;
    pause();
  }
  std::unique_lock lock(mutex_);
  ++sleepers_;
  const bool started = started_.wait(lock, stop, is_new);
  --sleepers_;
  return started;
}

/// The first chunk of a thread, among those of the loop; for `owner` = thread_count_, their end.
std::size_t ThreadPool::first_chunk(unsigned owner) const {
  return job_.chunks * owner / thread_count_;
}

/// Takes the chunks of thread `self`, then those that other threads have left.
void ThreadPool::take_chunks(unsigned self) {
  std::uint32_t prepared = 0;  // number of the loop whose environment the thread has
  for (unsigned i = 0; i < thread_count_; ++i) {
    take_chunks_of((self + i) % thread_count_, self > 0, &prepared);
  }
}

/// @param is_worker whether the thread must take over the floating-point environment of the caller
void ThreadPool::take_chunks_of(unsigned owner, bool is_worker, std::uint32_t* prepared) {
  std::atomic<std::uint64_t>& value = tickets_[owner].value;
  std::uint64_t ticket = value.load();
  while ((ticket & kChunksLeft) != 0) {
    if (!value.compare_exchange_weak(ticket, ticket - 1)) continue;
    const auto loop = static_cast<std::uint32_t>(ticket >> 32);
    if (is_worker && *prepared != loop) std::fesetenv(&job_.environment);
    *prepared = loop;
    run_chunk(job_.first + first_chunk(owner + 1) - (ticket & kChunksLeft));
    ticket = value.load();
  }
}

void ThreadPool::run_chunk(std::size_t chunk) {
  const auto chunks = static_cast<std::uint32_t>(job_.chunks);
  try {
    job_.call(job_.body, chunk);
  } catch (...) {
    const std::lock_guard lock(mutex_);
    if (!error_ || chunk < error_chunk_) {
      error_ = std::current_exception();
      error_chunk_ = chunk;
    }
  }
  // After the last chunk, the next loop may begin at once and overwrite the job.
  if (done_.fetch_add(1, std::memory_order_acq_rel) + 1 == chunks) done_.notify_one();
}

}  // namespace JFPX_ABI
}  // namespace jfpx
