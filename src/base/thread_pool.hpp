/// Thread pool that runs the chunks of a loop. Chunk bounds must depend on the problem alone, never
/// on the number of threads, because the assignment of chunks to threads is unspecified.
#pragma once

#include <jfpx/config.hpp>

#include <atomic>
#include <cfenv>
#include <condition_variable>
#include <cstddef>
#include <exception>
#include <mutex>
#include <thread>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {

/// The calling thread takes part in each loop; the worker threads sleep between loops. A pool runs
/// one loop at a time: run() must not be called concurrently or from within a loop.
class JFPX_API ThreadPool {
 public:
  static constexpr unsigned kMaxThreads = 256;
  /// @throws InvalidArgument if `threads` exceeds kMaxThreads.
  static void check(unsigned threads);

  /// @param threads number of threads, including the caller's; 0: one per core. The pool has fewer
  ///   if the system refuses to start them.
  /// @throws InvalidArgument if `threads` exceeds kMaxThreads.
  explicit ThreadPool(unsigned threads);
  ~ThreadPool();
  ThreadPool(const ThreadPool&) = delete;
  ThreadPool& operator=(const ThreadPool&) = delete;

  /// Number of threads, including the caller's.
  unsigned threads() const noexcept { return static_cast<unsigned>(workers_.size()) + 1; }

  /// Calls body(chunk) for every chunk in [0, chunks), in any order and from any thread, and
  /// returns after the last call. If several chunks throw, rethrows the exception of the lowest
  /// one. Allocates no memory. Worker threads take over the floating-point environment of the
  /// calling thread (rounding mode, flush-to-zero, denormals-are-zero).
  template <class Body>
  void run(std::size_t chunks, const Body& body) {
    if (chunks <= 1 || workers_.empty()) {
      for (std::size_t i = 0; i < chunks; ++i) body(i);
      return;
    }
    run_shared({.call = [](const void* b, std::size_t i) { (*static_cast<const Body*>(b))(i); },
                .body = &body,
                .chunks = chunks});
  }

 private:
  struct Job {
    void (*call)(const void* body, std::size_t chunk) = nullptr;
    const void* body = nullptr;
    std::size_t chunks = 0;
    std::fenv_t environment{};  ///< of the calling thread
  };

  void run_shared(Job job);
  void work(const std::stop_token& stop);
  void take_chunks(const Job& job);

  std::mutex mutex_;
  std::condition_variable_any started_;
  std::condition_variable finished_;
  Job job_;
  unsigned generation_ = 0;  ///< number of the loop, so that a worker joins each loop only once
  bool open_ = false;        ///< workers may still join the loop
  unsigned busy_ = 0;        ///< workers that have joined the loop and not finished it
  std::atomic<std::size_t> next_{0};
  std::exception_ptr error_;
  std::size_t error_chunk_ = 0;
  std::vector<std::jthread> workers_;  ///< last: joined before other members are destroyed
};

}  // namespace JFPX_ABI
}  // namespace jfpx
