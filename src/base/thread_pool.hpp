/// Thread pool that runs the chunks of a loop. Chunk bounds must depend on the problem alone, never
/// on the number of threads, because the assignment of chunks to threads is unspecified.
#pragma once

#include <jfpx/config.hpp>

#include <atomic>
#include <cfenv>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <exception>
#include <memory>
#include <mutex>
#include <thread>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {

/// The calling thread takes part in each loop. Every thread begins with chunks of its own, which
/// are consecutive and the same in equal loops, so that caches keep their data; then it takes
/// chunks of the others. Worker threads poll for the next loop for some microseconds and then
/// sleep, so that consecutive short loops start without a system call. A pool runs one loop at a
/// time: run() must not be called concurrently or from within a loop.
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
  unsigned threads() const noexcept { return thread_count_; }

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
    std::size_t first = 0;  ///< number of the first chunk
    std::size_t chunks = 0;
    std::fenv_t environment{};  ///< of the calling thread
  };

  void run_shared(Job job);
  void run_part(const Job& job);
  void work(const std::stop_token& stop, unsigned self);
  void take_chunks(unsigned self);
  void take_chunks_of(unsigned owner, bool is_worker, std::uint32_t* prepared);
  void run_chunk(std::size_t chunk);
  bool wait_for_loop(const std::stop_token& stop, std::uint32_t* seen);
  std::size_t first_chunk(unsigned owner) const;

  /// Chunks of a thread.
  struct alignas(64) Ticket {
    /// Number of the loop in the upper half, number of chunks that are not taken in the lower half.
    std::atomic<std::uint64_t> value{0};
  };

  /// The loop that runs. A thread may read it only after it has taken a chunk, and until that chunk
  /// is done, because the next loop overwrites it.
  Job job_;
  unsigned thread_count_ = 1;
  std::unique_ptr<Ticket[]> tickets_;   ///< by thread; 0 is the caller
  std::atomic<std::uint32_t> loop_{0};  ///< number of the last loop
  std::atomic<std::uint32_t> done_{0};  ///< chunks of the loop that are complete
  unsigned polls_ = 0;                  ///< number of times that a worker polls before it sleeps

  std::mutex mutex_;  ///< of what follows
  std::condition_variable_any started_;
  std::atomic<unsigned> sleepers_{0};
  std::exception_ptr error_;
  std::size_t error_chunk_ = 0;
  std::vector<std::jthread> workers_;  ///< last: joined before other members are destroyed
};

}  // namespace JFPX_ABI
}  // namespace jfpx
