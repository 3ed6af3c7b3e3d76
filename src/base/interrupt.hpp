/// Interruption of long searches, such as by Ctrl-C.
#pragma once

#include <jfpx/config.hpp>

#include "src/base/thread_pool.hpp"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstddef>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {

/// While it exists, searches of the thread that created it call a function at intervals, in this
/// thread. An exception of the function ends the search, which throws it; the collider stays
/// usable. Only loops of the functions below are interruptible. In a program without an interrupt,
/// these loops read one counter and do nothing else.
class JFPX_API Interrupt {
 public:
  using Clock = std::chrono::steady_clock;
  static constexpr std::chrono::milliseconds kInterval{20};

  /// @param check function that throws to end a search
  /// @param interval minimum time between two calls
  explicit Interrupt(void (*check)(), Clock::duration interval = kInterval);
  ~Interrupt();
  Interrupt(const Interrupt&) = delete;
  Interrupt& operator=(const Interrupt&) = delete;

  /// The last one that the calling thread has created; null if there is none.
  static Interrupt* current() noexcept;

  /// Calls the function if it is due. Must be called in the thread that created the object.
  void poll();

 private:
  void (*check_)();
  Clock::duration interval_;
  Clock::time_point last_ = Clock::now();
  Interrupt* outer_;
};

/// Calls the function of the interrupt of the calling thread if there is one and it is due.
inline void poll_interrupt() {
  if (Interrupt* const interrupt = Interrupt::current()) interrupt->poll();
}

/// pool.run(chunks, body), which an interrupt of the calling thread can end: all threads then skip
/// the remaining chunks. A single chunk is not interrupted.
template <class Body>
void run_interruptible(ThreadPool& pool, std::size_t chunks, const Body& body) {
  Interrupt* const interrupt = Interrupt::current();
  if (interrupt == nullptr || chunks <= 1) return pool.run(chunks, body);
  std::atomic<bool> ended{false};
  pool.run(chunks, [&](std::size_t chunk) {
    if (ended.load(std::memory_order_relaxed)) return;
    if (Interrupt::current() == interrupt) {  // not in a worker thread
      try {
        interrupt->poll();
      } catch (...) {
        ended.store(true, std::memory_order_relaxed);
        throw;
      }
    }
    body(chunk);
  });
}

/// Calls body(first, last) for the parts of [0, count), in order, in the calling thread, whose
/// interrupt can end the loop between two parts.
template <class Body>
void for_each_part_interruptible(std::size_t count, const Body& body) {
  constexpr std::size_t kPart = std::size_t{1} << 14;
  Interrupt* const interrupt = Interrupt::current();
  for (std::size_t first = 0; first < count; first += kPart) {
    if (interrupt != nullptr && first > 0) interrupt->poll();
    body(first, std::min(count, first + kPart));
  }
}
/// Calls body(i) for all i in [0, count), likewise.
template <class Body>
void for_each_interruptible(std::size_t count, const Body& body) {
  for_each_part_interruptible(count, [&](std::size_t first, std::size_t last) {
    for (std::size_t i = first; i < last; ++i) body(i);
  });
}
/// Makes an empty vector `count` long. Filling gigabytes of new memory takes seconds.
template <class Item>
void resize_interruptible(std::vector<Item>* items, std::size_t count) {
  items->reserve(count);
  for_each_part_interruptible(count, [&](std::size_t, std::size_t last) { items->resize(last); });
}

}  // namespace JFPX_ABI
}  // namespace jfpx
