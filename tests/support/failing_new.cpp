/// Replacement of operator new in a test program.
#include "tests/support/failing_new.hpp"

#include <atomic>
#include <cstdlib>
#include <limits>
#include <random>
#if defined(_WIN32)
#include <malloc.h>
#endif

namespace {

constexpr std::size_t kNever = std::numeric_limits<std::size_t>::max();

std::atomic<std::size_t> calls{0}, alive{0};
std::atomic<std::size_t> first_failure{kNever}, last_failure{kNever};
std::atomic<bool> has_failed{false};

void* allocate(std::size_t bytes, std::size_t alignment) {
  const std::size_t call = calls++;
  if (call >= first_failure && call <= last_failure) {
    has_failed = true;
    throw std::bad_alloc();
  }
#if defined(_WIN32)
  void* const memory = _aligned_malloc(bytes > 0 ? bytes : 1, alignment);
#else
  void* memory = nullptr;
  if (posix_memalign(&memory, alignment, bytes) != 0) memory = nullptr;
#endif
  if (memory == nullptr) throw std::bad_alloc();
  ++alive;
  return memory;
}
void release(void* memory) noexcept {
  if (memory != nullptr) --alive;
#if defined(_WIN32)
  _aligned_free(memory);
#else
  std::free(memory);
#endif
}

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

FailingNew::FailingNew(std::size_t k, Shortage shortage) {
  has_failed = false;
  const std::size_t failing = calls + k;
  last_failure = shortage == Shortage::once ? failing : kNever;
  first_failure = failing;
}
FailingNew::~FailingNew() { first_failure = kNever; }
bool FailingNew::failed() { return has_failed; }

std::size_t live_allocations() { return alive; }

std::size_t with_every_failure(
    const std::function<bool(std::size_t k, Shortage shortage)>& attempt) {
  std::size_t failures = 0;
  for (const Shortage shortage : {Shortage::once, Shortage::permanent}) {
    for (std::size_t k = 0; attempt(k, shortage); ++k) ++failures;
  }
  return failures;
}

std::size_t with_some_failures(
    std::uint64_t seed, const std::function<bool(std::size_t k, Shortage shortage)>& attempt) {
  std::size_t failures = 0;
  std::mt19937_64 random(seed);
  for (const Shortage shortage : {Shortage::once, Shortage::permanent}) {
    for (std::size_t k = 0; attempt(k, shortage); k += 1 + random() % (1 + k / 16)) ++failures;
  }
  return failures;
}

}  // namespace test
}  // namespace JFPX_ABI
}  // namespace jfpx
