/// Memory of the CPU collider: warm calls do not allocate, and a failed allocation is an error that
/// reports the size. Replaces the global operator new of this program.
#include <jfpx/error.hpp>
#include <jfpx/sphere_collider.hpp>

#include "tests/support/sphere_fixtures.hpp"

#include <atomic>
#include <cstdlib>
#include <limits>
#include <new>

namespace {

std::atomic<std::size_t> allocations{0};
std::atomic<std::size_t> largest_allowed{std::numeric_limits<std::size_t>::max()};

void* allocate(std::size_t bytes, std::size_t alignment) {
  ++allocations;
  if (bytes > largest_allowed) throw std::bad_alloc();
  void* p = nullptr;
  if (posix_memalign(&p, alignment, bytes) != 0) throw std::bad_alloc();
  return p;
}
// Not inlined: g++ would report free() of memory from operator new as a mismatch.
[[gnu::noinline]] void release(void* p) noexcept { std::free(p); }

}  // namespace

void* operator new(std::size_t n) { return allocate(n, __STDCPP_DEFAULT_NEW_ALIGNMENT__); }
void* operator new(std::size_t n, std::align_val_t a) {
  return allocate(n, static_cast<std::size_t>(a));
}
void operator delete(void* p) noexcept { release(p); }
void operator delete(void* p, std::size_t) noexcept { release(p); }
void operator delete(void* p, std::align_val_t) noexcept { release(p); }
void operator delete(void* p, std::size_t, std::align_val_t) noexcept { release(p); }

namespace jfpx {
inline namespace JFPX_ABI {
namespace test {
namespace {

class Allocation : public testing::TestWithParam<std::tuple<SphereAlgorithm, unsigned>> {
 protected:
  std::unique_ptr<SphereCollider> make() const {
    return make_sphere_collider({.backend = Backend::cpu,
                                 .algorithm = std::get<0>(GetParam()),
                                 .threads = std::get<1>(GetParam())});
  }
  void TearDown() override { largest_allowed = std::numeric_limits<std::size_t>::max(); }
};

TEST_P(Allocation, WarmCallsAllocateNothing) {
  Random random(base_seed());
  const auto collider = make();
  for (const char* name : {"uniform", "polydisperse", "outliers"}) {
    const auto spheres = sphere_kind(name).make(5000, random);
    std::vector<SpherePair> pairs(20000);
    for (SpherePair& p : pairs) {
      p.a = static_cast<SphereIndex>(random.below(5000));
      p.b = static_cast<SphereIndex>(random.below(5000));
    }
    collider->find_contacts(spheres);
    collider->find_touching(spheres, pairs);
    const std::size_t before = allocations;
    collider->find_contacts(spheres);
    collider->find_touching(spheres, pairs);
    EXPECT_EQ(allocations - before, 0u) << name << ", " << seed_note();
  }
}

// The allocation of every buffer fails once: the limit shrinks through all their sizes.
TEST_P(Allocation, RunningOutIsAnErrorThatNamesBytesAndTheColliderStaysUsable) {
  Random random(base_seed());
  const auto spheres = sphere_kind("polydisperse").make(3000, random);
  const auto expected = brute_force(spheres);
  const auto collider = make();
  int failures = 0;
  for (std::size_t limit = 1u << 22; limit >= 1024; limit = limit * 3 / 4) {
    const auto fresh = make();
    largest_allowed = limit;
    try {
      fresh->find_contacts(spheres);
    } catch (const OutOfMemory& e) {
      ++failures;
      const std::string message = e.what();
      EXPECT_NE(message.find(" bytes needed for "), std::string::npos) << message;
    }
    largest_allowed = std::numeric_limits<std::size_t>::max();
    EXPECT_TRUE(same_bits(fresh->find_contacts(spheres), expected)) << seed_note();
  }
  EXPECT_GT(failures, 5);
}

INSTANTIATE_TEST_SUITE_P(X86, Allocation,
                         testing::Combine(testing::Values(SphereAlgorithm::all_pairs,
                                                          SphereAlgorithm::grid),
                                          testing::Values(1u, 3u)));

}  // namespace
}  // namespace test
}  // namespace JFPX_ABI
}  // namespace jfpx
