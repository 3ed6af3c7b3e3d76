/// A Bullet program without jfpx, which drops spheres and prints a hash of their final positions.
/// Each argument is the number of spheres of a further world; every world has its own thread.
#include "tests/bullet/stock_world.hpp"

#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <thread>
#include <vector>

int main(int argc, char** argv) {
  std::vector<std::uint64_t> hashes(static_cast<std::size_t>(argc));
  std::vector<std::thread> threads;
  for (int i = 1; i < argc; ++i) {
    threads.emplace_back([&hashes, argv, i] {
      hashes[static_cast<std::size_t>(i)] = stock_world::drop(std::atoi(argv[i]));
    });
  }
  for (std::thread& thread : threads) thread.join();
  for (int i = 1; i < argc; ++i) {
    std::printf("%016llx\n", static_cast<unsigned long long>(hashes[static_cast<std::size_t>(i)]));
  }
  return argc == 1 ? 7 : 0;
}
