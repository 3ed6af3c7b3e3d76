/// Threads that share the chunks of a loop. Who runs which chunk is open, so chunks must not depend
/// on it: their bounds follow from the problem alone, never from the number of threads.
#pragma once

#include <jfpx/config.hpp>

#include <atomic>
#include <condition_variable>
#include <cstddef>
#include <exception>
#include <mutex>
#include <thread>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {

/// The caller is one of the threads; the others sleep between loops. One loop at a time.
class JFPX_API ThreadPool {
 public:
  static constexpr unsigned kMaxThreads = 256;
  /// @throws InvalidArgument for more than kMaxThreads.
  static void check(unsigned threads);

  /// @param threads 0: one per core. Fewer are started where the system refuses more.
  /// @throws InvalidArgument as check() does.
  explicit ThreadPool(unsigned threads);
  ~ThreadPool();
  ThreadPool(const ThreadPool&) = delete;
  ThreadPool& operator=(const ThreadPool&) = delete;

  unsigned threads() const noexcept { return static_cast<unsigned>(workers_.size()) + 1; }

  /// Calls body(chunk) for every chunk in [0, chunks), in any order and from any thread, and waits
  /// for all. Rethrows the exception of the lowest chunk that threw. Allocates nothing.
  template <class Body>
  void run(std::size_t chunks, const Body& body) {
    if (chunks <= 1 || workers_.empty()) {
      for (std::size_t i = 0; i < chunks; ++i) body(i);
      return;
    }
    run_shared(
        {[](const void* b, std::size_t i) { (*static_cast<const Body*>(b))(i); }, &body, chunks});
  }

 private:
  struct Job {
    void (*call)(const void* body, std::size_t chunk) = nullptr;
    const void* body = nullptr;
    std::size_t chunks = 0;
  };

  void run_shared(const Job& job);
  void work(const std::stop_token& stop);
  void take_chunks(const Job& job);

  std::mutex mutex_;
  std::condition_variable_any started_;
  std::condition_variable finished_;
  Job job_;
  unsigned generation_ = 0;  ///< counts loops, so that a worker joins each once
  bool open_ = false;        ///< whether workers may still join the loop
  unsigned busy_ = 0;        ///< workers that have joined and not finished it
  std::atomic<std::size_t> next_{0};
  std::exception_ptr error_;
  std::size_t error_chunk_ = 0;
  std::vector<std::jthread> workers_;  ///< last: joined before the rest goes
};

}  // namespace JFPX_ABI
}  // namespace jfpx
