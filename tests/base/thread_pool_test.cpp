/// Tests of ThreadPool and of the loops that it runs.
#include "src/base/thread_pool.hpp"

#include "src/base/parallel_for.hpp"
#include "tests/support/seed.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <cfenv>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <filesystem>
#include <functional>
#include <initializer_list>
#include <iterator>
#include <limits>
#include <memory>
#include <mutex>
#include <numeric>
#include <random>
#include <set>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#if defined(__x86_64__)
#include <xmmintrin.h>
#endif

namespace jfpx {
inline namespace JFPX_ABI {
namespace {

TEST(ThreadPool, RunsEveryChunkOnce) {
  for (const unsigned threads : {1u, 2u, 5u}) {
    ThreadPool pool(threads);
    EXPECT_EQ(pool.threads(), threads);
    for (const std::size_t chunks : std::initializer_list<std::size_t>{0, 1, 2, 7, 1000}) {
      std::vector<int> runs(chunks);
      pool.run(chunks, [&](std::size_t i) { ++runs[i]; });
      EXPECT_EQ(runs, std::vector<int>(chunks, 1));
    }
  }
}

TEST(ThreadPool, ReducesEveryItemOnce) {
  ThreadPool pool(4);
  for (ThreadPool* const p : {static_cast<ThreadPool*>(nullptr), &pool}) {
    for (const std::size_t count : std::initializer_list<std::size_t>{0, 1, 63, 64, 65, 10000}) {
      const auto sum_of = [](std::size_t first, std::size_t last) {
        std::size_t sum = 0;
        for (std::size_t i = first; i < last; ++i) sum += i;
        return sum;
      };
      const std::size_t sum = parallel_reduce(p, count, 64, std::size_t{7}, sum_of, std::plus<>());
      EXPECT_EQ(sum, 7 + count * (count + 1) / 2 - count) << count;
    }
  }
}

TEST(ThreadPool, ManyShortLoopsInARow) {
  ThreadPool pool(4);
  std::vector<std::size_t> sums(3);
  for (std::size_t i = 0; i < 2000; ++i) pool.run(3, [&](std::size_t c) { sums[c] += i; });
  EXPECT_EQ(sums, std::vector<std::size_t>(3, 2000 * 1999 / 2));
}

/// Chunk 3 belongs to the thread that runs chunk 2, and the caller begins with chunk 0.
TEST(ThreadPool, WorkersTakeTheChunksOfBusyThreads) {
  ThreadPool pool(3);
  for (int round = 0; round < 20; ++round) {
    std::atomic<bool> is_run{false};
    pool.run(6, [&](std::size_t i) {
      if (i == 3) is_run = true;
      while (i % 2 == 0 && i < 4 && !is_run) std::this_thread::yield();
    });
    EXPECT_TRUE(is_run);
  }
}

/// A chunk begins after all chunks of the phases before it.
TEST(ThreadPool, RunsPhasesOneAfterTheOther) {
  const test::Seed seed;
  std::mt19937 random(seed);
  for (const unsigned threads : {1u, 2u, 3u, 8u}) {
    ThreadPool pool(threads);
    std::uniform_int_distribution<std::size_t> few(0, 6), many(0, 8 * threads);
    for (int round = 0; round < 300; ++round) {
      std::vector<std::size_t> chunks(few(random));
      std::size_t all = 0;
      for (std::size_t& count : chunks) all += count = few(random) < 4 ? few(random) : many(random);
      std::vector<std::size_t> before(chunks.size());
      std::exclusive_scan(chunks.begin(), chunks.end(), before.begin(), std::size_t{0});
      std::vector<int> runs(all);
      std::atomic<std::size_t> completed{0}, too_early{0};
      pool.run_phases(
          chunks.size(), [&](std::size_t phase) { return chunks[phase]; },
          [&](std::size_t phase, std::size_t chunk) {
            if (completed.load() < before[phase]) ++too_early;
            ++runs[before[phase] + chunk];
            ++completed;
          });
      ASSERT_EQ(runs, std::vector<int>(all, 1));
      ASSERT_EQ(too_early.load(), 0u);
      std::vector<int> others(few(random));
      pool.run(others.size(), [&](std::size_t i) { ++others[i]; });
      ASSERT_EQ(others, std::vector<int>(others.size(), 1));
    }
  }
}

TEST(ThreadPool, RethrowsTheErrorOfTheLowestChunkAndGoesOn) {
  for (const unsigned threads : {1u, 3u}) {
    ThreadPool pool(threads);
    for (int repeat = 0; repeat < 50; ++repeat) {
      try {
        pool.run(100, [](std::size_t i) {
          if (i >= 20) throw std::runtime_error(std::to_string(i));
        });
        ADD_FAILURE() << "no exception was thrown";
      } catch (const std::runtime_error& e) {
        EXPECT_STREQ(e.what(), "20");
      }
      std::vector<int> runs(10);
      pool.run(10, [&](std::size_t i) { ++runs[i]; });
      EXPECT_EQ(std::accumulate(runs.begin(), runs.end(), 0), 10);
    }
  }
}

TEST(ThreadPool, ComputesInTheFloatingPointEnvironmentOfTheCaller) {
  ThreadPool pool(4);
  constexpr std::size_t kChunks = 64;
  for (const int mode : {FE_TONEAREST, FE_UPWARD, FE_DOWNWARD, FE_TONEAREST}) {
    std::vector<int> modes(kChunks, -1);
    std::fesetround(mode);
    pool.run(kChunks, [&](std::size_t i) {
      modes[i] = std::fegetround();
      std::this_thread::sleep_for(std::chrono::microseconds(50));  // so that workers take part
    });
    std::fesetround(FE_TONEAREST);
    EXPECT_EQ(modes, std::vector<int>(kChunks, mode));
  }
}

/// The threads that take part in a loop.
std::set<std::thread::id> threads_of(ThreadPool& pool) {
  std::vector<std::thread::id> ids(4 * pool.threads());
  std::atomic<unsigned> started{0};
  pool.run(ids.size(), [&](std::size_t i) {
    ids[i] = std::this_thread::get_id();
    // The first chunk of each thread takes until all threads have begun.
    for (++started; started < pool.threads();) std::this_thread::yield();
  });
  return {ids.begin(), ids.end()};
}

TEST(ThreadPool, SharesTheThreadsOfPoolsOfEqualSize) {
  ThreadPool first(3), second(3), larger(4);
  const auto threads = threads_of(first);
  EXPECT_EQ(threads.size(), 3u);
  EXPECT_EQ(threads_of(second), threads);
  EXPECT_EQ(threads_of(larger).size(), 4u);
  EXPECT_EQ(threads_of(first), threads);
}

TEST(ThreadPool, RunsALoopWithinALoopOfAnotherPool) {
  ThreadPool outer(3);
  std::vector<int> runs(20 * 30);
  outer.run(20, [&](std::size_t i) {
    ThreadPool inner(3);
    inner.run(30, [&](std::size_t k) { ++runs[30 * i + k]; });
  });
  EXPECT_EQ(runs, std::vector<int>(runs.size(), 1));
  ThreadPool inner(3);  // shares the workers of `outer`, and is used by its first chunk
  std::vector<int> nested(30);
  outer.run(20, [&](std::size_t i) {
    if (i == 0) inner.run(30, [&](std::size_t k) { ++nested[k]; });
  });
  EXPECT_EQ(nested, std::vector<int>(30, 1));
  EXPECT_EQ(threads_of(inner).size(), 3u);
}

TEST(ThreadPool, SeparatesPoolsWhoseLoopsRunAtTheSameTime) {
  ThreadPool first(2), second(2);
  std::atomic<int> inside{0};
  // Each loop ends only after the other one has begun.
  const auto meet = [&](ThreadPool& pool) {
    pool.run(2, [&](std::size_t i) {
      if (i != 0) return;
      for (++inside; inside < 2;) std::this_thread::yield();
    });
  };
  std::thread other([&] { meet(second); });
  meet(first);
  other.join();
  EXPECT_EQ(inside, 2);
  const auto a = threads_of(first), b = threads_of(second);
  const bool has_free_core = std::thread::hardware_concurrency() > 2;
  EXPECT_EQ(std::count_if(a.begin(), a.end(), [&](auto id) { return b.contains(id); }),
            has_free_core ? 1 : 2)
      << "the calling thread, and a worker if another one had no core";
}

#if defined(__linux__)  // shows the threads of a process in a folder
/// The threads of this process.
long count_threads() {
  using Folder = std::filesystem::directory_iterator;
  return std::distance(Folder("/proc/self/task"), Folder());
}

TEST(ThreadPool, StartsNoMoreThreadsThanTheLargestPoolOfAProcessHas) {
  constexpr unsigned kCallers = 8, kThreads = 64;
  const long before = count_threads();
  std::atomic<long> most{0};
  std::atomic<unsigned> ready{0};
  std::vector<std::thread> callers;
  for (unsigned caller = 0; caller < kCallers; ++caller) {
    callers.emplace_back([&] {
      ThreadPool first(kThreads), second(kThreads);
      for (++ready; ready < kCallers;) std::this_thread::yield();
      for (int repeat = 0; repeat < 20; ++repeat) {
        for (ThreadPool* const pool : {&first, &second}) {
          std::vector<int> runs(200);
          pool->run(runs.size(), [&](std::size_t i) { ++runs[i]; });
          EXPECT_EQ(runs, std::vector<int>(runs.size(), 1));
        }
        for (long now = count_threads(), old = most; old < now;) {
          if (most.compare_exchange_weak(old, now)) break;
        }
      }
    });
  }
  for (std::thread& caller : callers) caller.join();
  const unsigned workers = std::max(kThreads, std::thread::hardware_concurrency()) - 1;
  EXPECT_LE(most - before, static_cast<long>(kCallers + workers));
}
#endif

/// Sets flush-to-zero of the calling thread.
void flush_denormals(bool flush) {
#if defined(__x86_64__)
  _MM_SET_FLUSH_ZERO_MODE(flush ? _MM_FLUSH_ZERO_ON : _MM_FLUSH_ZERO_OFF);
#else
  asm volatile("msr fpcr, %0" : : "r"(std::uint64_t{flush} << 24));
#endif
}

TEST(ThreadPool, FlushesDenormalsWhereTheCallerDoes) {
  ThreadPool pool(4);
  constexpr std::size_t kChunks = 64;
  for (const bool flush : {false, true, false}) {
    std::vector<int> flushed(kChunks, -1);
    flush_denormals(flush);
    pool.run(kChunks, [&](std::size_t i) {
      volatile float smallest = std::numeric_limits<float>::min();
      flushed[i] = smallest / 2 == 0;
      std::this_thread::sleep_for(std::chrono::microseconds(50));  // so that workers take part
    });
    flush_denormals(false);
    EXPECT_EQ(flushed, std::vector<int>(kChunks, flush));
  }
}

/// Threads of a program that run tasks in the order of their addition.
class TaskThreads {
 public:
  explicit TaskThreads(unsigned threads) {
    for (unsigned i = 0; i < threads; ++i) threads_.emplace_back([this] { work(); });
  }
  ~TaskThreads() {
    {
      const std::lock_guard lock(mutex_);
      ends_ = true;
    }
    changed_.notify_all();
    for (std::thread& thread : threads_) thread.join();
  }
  void add(std::function<void()> task) {
    {
      const std::lock_guard lock(mutex_);
      tasks_.push_back(std::move(task));
    }
    changed_.notify_one();
  }

 private:
  void work() {
    for (;;) {
      std::unique_lock lock(mutex_);
      changed_.wait(lock, [this] { return ends_ || !tasks_.empty(); });
      if (tasks_.empty()) return;
      const std::function<void()> task = std::move(tasks_.front());
      tasks_.pop_front();
      lock.unlock();
      task();
    }
  }

  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<std::function<void()>> tasks_;
  bool ends_ = false;
  std::vector<std::thread> threads_;
};

TEST(ThreadPool, TasksTakePartInLoopsWhileHelpersExist) {
  TaskThreads tasks(3);
  ThreadPool pool(4, [&](std::function<void()> task) { tasks.add(std::move(task)); });
  EXPECT_EQ(pool.threads(), 4u);
  const auto count_threads_of = [&] {
    std::vector<std::thread::id> ids(16);
    pool.run(ids.size(), [&](std::size_t i) { ids[i] = std::this_thread::get_id(); });
    return std::set(ids.begin(), ids.end()).size();
  };
  EXPECT_EQ(count_threads_of(), 1u);
  for (int repeat = 0; repeat < 20; ++repeat) {
    const ThreadPool::Helpers helpers(pool);
    EXPECT_EQ(threads_of(pool).size(), 4u);  // ends only if all take part
    std::vector<int> runs(60);
    pool.run_phases(
        6, [](std::size_t phase) { return phase; },
        [&](std::size_t phase, std::size_t chunk) { ++runs[10 * phase + chunk]; });
    for (std::size_t i = 0; i < runs.size(); ++i) EXPECT_EQ(runs[i], i % 10 < i / 10 ? 1 : 0) << i;
  }
  EXPECT_EQ(count_threads_of(), 1u);
}

TEST(ThreadPool, LoopsDoNotWaitForTasksThatHaveNotBegun) {
  std::vector<std::function<void()>> tasks;
  auto pool = std::make_unique<ThreadPool>(
      3, [&](std::function<void()> task) { tasks.push_back(std::move(task)); });
  for (int repeat = 0; repeat < 2; ++repeat) {
    const ThreadPool::Helpers helpers(*pool);
    EXPECT_EQ(tasks.size(), 2u * (static_cast<unsigned>(repeat) + 1));
    std::vector<int> runs(100);
    pool->run(runs.size(), [&](std::size_t i) { ++runs[i]; });
    EXPECT_EQ(runs, std::vector<int>(runs.size(), 1));
    if (repeat == 0) continue;
    tasks[0]();  // of the first helpers: returns, although others exist
  }
  pool.reset();
  for (const auto& task : tasks) task();
}

/// As a job system does whose wait() runs jobs.
TEST(ThreadPool, ATaskThatTheThreadOfTheLoopsCallsReturns) {
  std::function<void()> last;
  ThreadPool pool(2, [&](std::function<void()> task) {
    task();
    last = std::move(task);
  });
  const ThreadPool::Helpers helpers(pool);
  std::vector<int> runs(10);
  pool.run(runs.size(), [&](std::size_t i) {
    ++runs[i];
    last();
  });
  EXPECT_EQ(runs, std::vector<int>(10, 1));
}

/// Tasks of a period run in other threads than those of the one before, which may still be leaving.
TEST(ThreadPool, EachTaskTakesPartAlsoIfThereAreMoreThreadsThanTasks) {
  TaskThreads tasks(5);
  ThreadPool pool(2, [&](std::function<void()> task) { tasks.add(std::move(task)); });
  for (int period = 0; period < 300; ++period) {
    const ThreadPool::Helpers helpers(pool);
    EXPECT_EQ(threads_of(pool).size(), 2u);  // ends only if the task takes part
  }
}

TEST(ThreadPool, HelpersEndWithTheErrorOfTheFunctionThatEnqueues) {
  int calls = 0;
  ThreadPool pool(3, [&](const std::function<void()>&) {
    if (++calls == 2) throw std::runtime_error("full");
  });
  EXPECT_THROW(ThreadPool::Helpers helpers(pool), std::runtime_error);
  std::vector<int> runs(10);
  pool.run(runs.size(), [&](std::size_t i) { ++runs[i]; });
  EXPECT_EQ(runs, std::vector<int>(10, 1));
}

TEST(ThreadPool, TasksKeepTheFloatingPointEnvironmentOfTheirThreads) {
  std::atomic<int> rounding{-1};
  TaskThreads tasks(1);
  ThreadPool pool(2, [&](std::function<void()> task) {
    tasks.add([&rounding, task = std::move(task)] {
      std::fesetround(FE_UPWARD);
      task();
      rounding = std::fegetround();
      std::fesetround(FE_TONEAREST);
    });
  });
  std::vector<int> modes(2);
  {
    const ThreadPool::Helpers helpers(pool);
    std::atomic<int> begun{0};
    pool.run(2, [&](std::size_t i) {
      for (++begun; begun < 2;) std::this_thread::yield();
      modes[i] = std::fegetround();
    });
  }
  while (rounding == -1) std::this_thread::yield();
  EXPECT_EQ(modes, std::vector<int>(2, FE_TONEAREST));
  EXPECT_EQ(rounding, FE_UPWARD);
}

TEST(ThreadPool, RunsEveryChunkOnceWhileTasksComeAndGo) {
  const test::Seed seed;
  std::mt19937 random(seed);
  TaskThreads tasks(2);
  ThreadPool pool(4, [&](std::function<void()> task) { tasks.add(std::move(task)); });
  for (int period = 0; period < 300; ++period) {
    const ThreadPool::Helpers helpers(pool);
    for (std::uint64_t loops = random() % 5; loops > 0; --loops) {
      std::vector<int> runs(random() % 40);
      pool.run(runs.size(), [&](std::size_t i) { ++runs[i]; });
      EXPECT_EQ(runs, std::vector<int>(runs.size(), 1));
    }
  }
}

}  // namespace
}  // namespace JFPX_ABI
}  // namespace jfpx
