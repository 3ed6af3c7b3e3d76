/// Thread pool that runs the chunks of a loop. Chunk bounds must not depend on the number of
/// threads, because the assignment of chunks to threads is unspecified.
#pragma once

#include <jfpx/config.hpp>

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>

namespace jfpx {
inline namespace JFPX_ABI {

/// Enqueues a task that any thread calls once, at any time, and returns without waiting for it.
using EnqueueTask = std::function<void(std::function<void()> task)>;

/// The calling thread takes part in each loop. Every thread starts with its own consecutive chunks,
/// which are the same in equal loops, so that caches keep their data; then it takes chunks of other
/// threads. Worker threads poll for the next loop, so that consecutive loops start without a system
/// call, and then sleep: after a millisecond, or after some tens of microseconds if other threads
/// need the cores. A pool runs one loop at a time: run() must not be called concurrently or from
/// within a loop.
///
/// Pools of equal size that one thread creates share their workers, so that consecutive parts of a
/// step keep the same threads awake. If another pool is using the shared workers when a loop
/// begins, the pool gets other ones. Pools of equal size start no more threads than the largest
/// pool has or, if that is more, than there are cores: beyond, pools of several threads share their
/// workers, and a loop that finds all of them in use runs on the calling thread alone. Workers end
/// with the last of their pools.
class JFPX_API ThreadPool {
 public:
  static constexpr unsigned kMaxThreads = 256;
  /// @throws InvalidArgument if `threads` exceeds kMaxThreads.
  static void check(unsigned threads);

  /// @param threads number of threads, including the caller's; 0: one per core. The pool is smaller
  ///   if the system refuses to start threads.
  /// @throws InvalidArgument if `threads` exceeds kMaxThreads.
  explicit ThreadPool(unsigned threads);
  /// A pool without threads of its own. While a Helpers object exists, tasks take part in the
  /// loops; otherwise the calling thread runs them alone.
  /// @param threads most threads of a loop, including the caller's; 0: one per core
  /// @param enqueue empty: the pool has threads of its own, as above @throws as above
  ThreadPool(unsigned threads, EnqueueTask enqueue);
  ~ThreadPool();
  ThreadPool(const ThreadPool&) = delete;
  ThreadPool& operator=(const ThreadPool&) = delete;

  /// Number of threads, including the caller's.
  unsigned threads() const noexcept;

  class Helpers;

  /// Calls body(chunk) for every chunk in [0, chunks), in any order and from any thread, and
  /// returns after the last call. If several chunks throw, rethrows the exception of the lowest
  /// one. Throws no other exceptions, even if workers cannot be allocated. Worker threads use the
  /// floating-point environment of the calling thread (rounding mode, flush-to-zero,
  /// denormals-are-zero).
  template <class Body>
  void run(std::size_t chunks, const Body& body) {
    if (chunks <= 1 || workers_ == nullptr) {
      for (std::size_t i = 0; i < chunks; ++i) body(i);
      return;
    }
    run_shared({.call = [](const void* b, std::size_t,
                           std::size_t i) { (*static_cast<const Body*>(b))(i); },
                .body = &body,
                .chunks = chunks});
  }

  /// Same as a loop for each phase, one after the other: calls body(phase, chunk) for every chunk
  /// in [0, chunks_of(phase)). Threads that wait for the end of a phase poll, and begin the next
  /// one without the caller, which takes less time than a loop.
  /// @param chunks_of must return the same number for a phase in all calls, from any thread; it
  /// must
  ///   not throw
  template <class Chunks, class Body>
  void run_phases(std::size_t phases, const Chunks& chunks_of, const Body& body) {
    if (workers_ == nullptr) {
      for (std::size_t phase = 0; phase < phases; ++phase) {
        const std::size_t chunks = chunks_of(phase);
        for (std::size_t i = 0; i < chunks; ++i) body(phase, i);
      }
      return;
    }
    struct Functions {
      const Chunks& chunks_of;
      const Body& body;
    };
    const Functions functions{chunks_of, body};
    run_shared({.call = [](const void* f, std::size_t phase,
                           std::size_t i) { static_cast<const Functions*>(f)->body(phase, i); },
                .body = &functions,
                .chunks_of = [](const void* f, std::size_t phase) -> std::size_t {
                  return static_cast<const Functions*>(f)->chunks_of(phase);
                },
                .phases = phases});
  }

 private:
  class Workers;
  struct Loop {
    void (*call)(const void* body, std::size_t phase, std::size_t chunk) = nullptr;
    const void* body = nullptr;
    std::size_t chunks = 0;  ///< of a loop without phases
    std::size_t (*chunks_of)(const void* body, std::size_t phase) = nullptr;
    std::size_t phases = 0;  ///< 0: a loop without phases
  };

  static void run_alone(const Loop& loop);
  void run_shared(const Loop& loop);

  std::shared_ptr<Workers> workers_;  ///< null with one thread
  EnqueueTask enqueue_;               ///< empty: the workers have threads of their own
};

/// Lets tasks take part in the loops of a pool while it exists. Has no effect on a pool with
/// threads of its own. A task occupies its thread until the object is destroyed. The destructor
/// does not wait for tasks: those that begin later return at once, even after the pool is
/// destroyed. So does a task that the thread of the loops itself calls.
class JFPX_API ThreadPool::Helpers {
 public:
  /// @throws the exceptions of the function that enqueues tasks
  explicit Helpers(const ThreadPool& pool);
  ~Helpers();
  Helpers(const Helpers&) = delete;
  Helpers& operator=(const Helpers&) = delete;

 private:
  std::shared_ptr<Workers> workers_;  ///< null: no effect
};

}  // namespace JFPX_ABI
}  // namespace jfpx
