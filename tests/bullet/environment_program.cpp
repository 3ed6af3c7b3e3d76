/// A Bullet program without jfpx in an environment that few programs have:
///
///     allocators             two worlds, each with an allocator of its own
///     traps SPHERES          floating-point traps are enabled
///     flags SPHERES          prints whether a step sets flags of floating-point exceptions
///     rounding SPHERES       one world for each rounding mode
///     stack BYTES SPHERES    a thread with a stack of this size
///     name                   prints the name of a type, as a statically linked Bullet contains it
///     threads WORLDS         worlds that step at the same time; prints the number of threads
///
/// Prints hashes of the final positions.
#include "tests/bullet/stock_world.hpp"

#include <atomic>
#include <cfenv>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <iterator>
#include <pthread.h>
#include <string>
#include <thread>
#include <vector>

namespace {

void print(std::uint64_t hash) {
  std::printf("%016llx\n", static_cast<unsigned long long>(hash));
  std::fflush(stdout);
}

/// An allocator that aborts if it must free the memory of another one.
template <std::uint64_t kNumber>
struct Allocator {
  struct Header {
    std::uint64_t number;
    void* memory;
  };
  static inline std::atomic<long> live{0};

  static void* allocate(std::size_t size, int alignment) {
    const auto step = static_cast<std::size_t>(alignment < 16 ? 16 : alignment);
    char* const memory = static_cast<char*>(std::malloc(size + step + sizeof(Header)));
    const auto end = reinterpret_cast<std::uintptr_t>(memory) + sizeof(Header) + step - 1;
    char* const block = reinterpret_cast<char*>(end / step * step);
    const Header header{kNumber, memory};
    std::memcpy(block - sizeof header, &header, sizeof header);
    ++live;
    return block;
  }
  static void release(void* block) {
    if (block == nullptr) return;
    Header header;
    std::memcpy(&header, static_cast<char*>(block) - sizeof header, sizeof header);
    if (header.number != kNumber) {
      std::puts("memory of another allocator");
      std::fflush(stdout);
      std::abort();
    }
    --live;
    std::free(header.memory);
  }
  static void run(int spheres) {
    btAlignedAllocSetCustomAligned(allocate, release);
    print(stock_world::drop(spheres));
    std::printf("%ld blocks\n", live.load());
  }
};

void run_on_stack(std::size_t bytes, int spheres) {
  static int s_spheres = 0;
  static std::uint64_t s_hash = 0;
  s_spheres = spheres;
  pthread_attr_t attributes;
  pthread_attr_init(&attributes);
  pthread_attr_setstacksize(&attributes, bytes);
  pthread_t thread;
  const auto run = [](void*) -> void* {
    s_hash = stock_world::drop(s_spheres);
    return nullptr;
  };
  if (pthread_create(&thread, &attributes, run, nullptr) != 0) std::abort();
  pthread_join(thread, nullptr);
  print(s_hash);
}

const char kTypeName[] = "21btCollisionDispatcher";

long count_threads() {
  using Folder = std::filesystem::directory_iterator;
  return std::distance(Folder("/proc/self/task"), Folder());
}

void run_at_the_same_time(int worlds) {
  std::atomic<int> ready{0}, done{0};
  std::vector<std::thread> threads;
  for (int i = 0; i < worlds; ++i) {
    threads.emplace_back([&] {
      for (++ready; ready < worlds;) std::this_thread::yield();
      stock_world::drop(200);
      ++done;
    });
  }
  long most = 0;
  while (done < worlds) {
    most = std::max(most, count_threads());
    std::this_thread::yield();
  }
  for (std::thread& thread : threads) thread.join();
  std::printf("%ld threads\n", most);
}

}  // namespace

int main(int argc, char** argv) {
  const std::string mode = argc > 1 ? argv[1] : "";
  const int first = argc > 2 ? std::atoi(argv[2]) : 0, second = argc > 3 ? std::atoi(argv[3]) : 0;
  if (mode == "allocators") {
    Allocator<1>::run(100);
    Allocator<2>::run(300);
  } else if (mode == "traps") {
    feenableexcept(FE_INVALID | FE_DIVBYZERO | FE_OVERFLOW);
    print(stock_world::drop(first));
  } else if (mode == "flags") {
    std::feclearexcept(FE_ALL_EXCEPT);
    print(stock_world::drop(first));
    std::printf("%x\n",
                static_cast<unsigned>(std::fetestexcept(FE_INVALID | FE_DIVBYZERO | FE_OVERFLOW)));
  } else if (mode == "rounding") {
    for (const int rounding : {FE_UPWARD, FE_DOWNWARD, FE_TOWARDZERO, FE_TONEAREST}) {
      std::fesetround(rounding);
      print(stock_world::drop(first));
    }
  } else if (mode == "stack") {
    run_on_stack(static_cast<std::size_t>(first), second);
  } else if (mode == "name") {
    std::puts(kTypeName);
  } else if (mode == "threads") {
    run_at_the_same_time(first);
  } else {
    return 2;
  }
  return 0;
}
