/// A Bullet program without jfpx in an environment that few programs have:
///
///     allocators          two worlds, each with an allocator of its own
///     traps SPHERES       floating-point traps are enabled
///     flags SPHERES       prints the flags of floating-point exceptions
///     rounding SPHERES    one world for each rounding mode
///     stack SPHERES       prints the stack that a step takes, in bytes
///     name                prints a name that a statically linked Bullet contains
///     threads WORLDS      worlds that step at the same time; prints the number of threads
///
/// Prints hashes of the final positions.
#include "tests/bullet/stock_world.hpp"

#include <algorithm>
#include <atomic>
#include <cfenv>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <iterator>
#include <memory>
#include <pthread.h>
#include <string>
#include <sys/mman.h>
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

/// Runs a world on a thread with this stack.
void run_on_stack(void* stack, std::size_t bytes, int spheres) {
  const auto world = std::make_unique<stock_world::World>(spheres);
  pthread_attr_t attributes;
  pthread_attr_init(&attributes);
  pthread_attr_setstack(&attributes, stack, bytes);
  pthread_t thread;
  const auto run = [](void* its_world) -> void* {
    static_cast<stock_world::World*>(its_world)->run();
    return nullptr;
  };
  if (pthread_create(&thread, &attributes, run, world.get()) != 0) std::abort();
  pthread_join(thread, nullptr);
  print(world->hash());
}

void measure_stack(int spheres) {
  constexpr std::size_t kBytes = std::size_t{1} << 20;
  constexpr unsigned char kUnused = 0xa5;
  void* const stack =
      mmap(nullptr, kBytes, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
  std::memset(stack, kUnused, kBytes);
  run_on_stack(stack, kBytes, spheres);
  const auto* const bytes = static_cast<const unsigned char*>(stack);
  const auto used = [](unsigned char byte) { return byte != kUnused; };
  std::printf("%td\n", bytes + kBytes - std::find_if(bytes, bytes + kBytes, used));
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
  const int first = argc > 2 ? std::atoi(argv[2]) : 0;
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
    measure_stack(first);
  } else if (mode == "name") {
    std::puts(kTypeName);
  } else if (mode == "threads") {
    run_at_the_same_time(first);
  } else {
    return 2;
  }
  return 0;
}
