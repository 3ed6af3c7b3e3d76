/// Injection of allocation failures into a whole program: see with_every_failure().
#pragma once

#include <jfpx/error.hpp>

#include <cstddef>
#include <cstdint>
#include <functional>
#include <new>

namespace jfpx {
inline namespace JFPX_ABI {
namespace test {

/// Which allocations fail.
enum class Shortage {
  once,      ///< one allocation
  permanent  ///< that allocation and all later ones
};

/// During its lifetime, the k-th call of operator new fails; with Shortage::permanent, all later
/// calls also fail. Requires that the program links failing_new.cpp. At most one object may exist.
class FailingNew {
 public:
  FailingNew(std::size_t k, Shortage shortage);
  ~FailingNew();
  FailingNew(const FailingNew&) = delete;
  FailingNew& operator=(const FailingNew&) = delete;

  static bool failed();  ///< whether an allocation has failed
};

/// Number of allocations that have not been freed.
std::size_t live_allocations();

/// For both shortages, calls `attempt(k, shortage)` for k = 0, 1, ... until it returns false. It
/// must return whether an allocation failed.
/// @return number of calls that returned true
std::size_t with_every_failure(
    const std::function<bool(std::size_t k, Shortage shortage)>& attempt);
/// The same for a sample, for attempts that make many allocations: the first 16 of them, then
/// random ones whose distances grow with k, so that the number of calls grows like the logarithm.
std::size_t with_some_failures(
    std::uint64_t seed, const std::function<bool(std::size_t k, Shortage shortage)>& attempt);

/// Executes the call with a failing k-th allocation.
/// @return whether the call threw OutOfMemory or std::bad_alloc
template <class Call>
bool runs_out(std::size_t k, Shortage shortage, Call call) {
  FailingNew failing(k, shortage);
  try {
    call();
    return false;
  } catch (const OutOfMemory&) {
  } catch (const std::bad_alloc&) {  // a small allocation, for example of the message
  }
  return true;
}

}  // namespace test
}  // namespace JFPX_ABI
}  // namespace jfpx
