/// Implementation of ThreadPool: threads take chunks from a shared counter.
#include "src/base/thread_pool.hpp"

#include <jfpx/error.hpp>

#include <algorithm>
#include <string>
#include <system_error>
#include <utility>

namespace jfpx {
inline namespace JFPX_ABI {

void ThreadPool::check(unsigned threads) {
  if (threads <= kMaxThreads) return;
  throw InvalidArgument("threads is " + std::to_string(threads) +
                        "; it must be 0 (one per core) to " + std::to_string(kMaxThreads));
}

ThreadPool::ThreadPool(unsigned threads) {
  check(threads);
  if (threads == 0) threads = std::clamp(std::thread::hardware_concurrency(), 1u, kMaxThreads);
  workers_.reserve(threads - 1);
  try {
    while (workers_.size() + 1 < threads) {
      workers_.emplace_back([this](const std::stop_token& stop) { work(stop); });
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
  {
    const std::lock_guard lock(mutex_);
    job_ = job;
    next_.store(0, std::memory_order_relaxed);
    open_ = true;
    ++generation_;
  }
  started_.notify_all();
  take_chunks(job);
  // All chunks are taken. Workers that the system has not scheduled yet would find no chunk, and on
  // a loaded machine waiting for them would take longer than the loop.
  std::unique_lock lock(mutex_);
  open_ = false;
  finished_.wait(lock, [&] { return busy_ == 0; });
  if (error_) std::rethrow_exception(std::exchange(error_, nullptr));
}

void ThreadPool::work(const std::stop_token& stop) {
  unsigned seen = 0;
  std::unique_lock lock(mutex_);
  while (started_.wait(lock, stop, [&] { return generation_ != seen; })) {
    seen = generation_;
    if (!open_) continue;
    ++busy_;
    const Job job = job_;
    lock.unlock();
    std::fesetenv(&job.environment);
    take_chunks(job);
    lock.lock();
    if (--busy_ == 0) finished_.notify_one();
  }
}

void ThreadPool::take_chunks(const Job& job) {
  for (;;) {
    const std::size_t chunk = next_.fetch_add(1, std::memory_order_relaxed);
    if (chunk >= job.chunks) return;
    try {
      job.call(job.body, chunk);
    } catch (...) {
      const std::lock_guard lock(mutex_);
      if (!error_ || chunk < error_chunk_) {
        error_ = std::current_exception();
        error_chunk_ = chunk;
      }
    }
  }
}

}  // namespace JFPX_ABI
}  // namespace jfpx
