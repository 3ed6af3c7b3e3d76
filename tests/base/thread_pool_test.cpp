/// Tests of ThreadPool.
#include "src/base/thread_pool.hpp"

#include <gtest/gtest.h>

#include <cfenv>
#include <chrono>
#include <cstdint>
#include <limits>
#include <numeric>
#include <stdexcept>
#include <string>
#include <thread>
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

TEST(ThreadPool, ManyShortLoopsInARow) {
  ThreadPool pool(4);
  std::vector<std::size_t> sums(3);
  for (std::size_t i = 0; i < 2000; ++i) pool.run(3, [&](std::size_t c) { sums[c] += i; });
  EXPECT_EQ(sums, std::vector<std::size_t>(3, 2000 * 1999 / 2));
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

}  // namespace
}  // namespace JFPX_ABI
}  // namespace jfpx
