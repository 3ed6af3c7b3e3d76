/// Memory that runs out on request, for a whole program: see with_every_failure().
#pragma once

#include <jfpx/error.hpp>

#include <cstddef>
#include <functional>
#include <new>

namespace jfpx {
inline namespace JFPX_ABI {
namespace test {

/// Which allocations fail.
enum class Shortage {
  once,     ///< only that one
  for_good  ///< and all after it
};

/// While it lives, operator new fails from its k-th call on. Programs that link failing_new.cpp
/// have a replaced operator new; one FailingNew at a time.
class FailingNew {
 public:
  FailingNew(std::size_t k, Shortage shortage);
  ~FailingNew();
  FailingNew(const FailingNew&) = delete;
  FailingNew& operator=(const FailingNew&) = delete;

  static bool failed();  ///< whether the call came to that allocation
};

/// Allocations that were not freed yet.
std::size_t living_allocations();

/// Calls `attempt(k, shortage)` for k = 0, 1, ... and both shortages, for as long as it says that
/// an allocation failed. @returns how many did
std::size_t with_every_failure(
    const std::function<bool(std::size_t k, Shortage shortage)>& attempt);

/// The call, with the k-th allocation failing. @returns whether it ended in an error, that of
/// memory
template <class Call>
bool runs_out(std::size_t k, Shortage shortage, Call call) {
  FailingNew failing(k, shortage);
  try {
    call();
    return false;
  } catch (const OutOfMemory&) {
  } catch (const std::bad_alloc&) {  // where even the message found no memory
  }
  return true;
}

}  // namespace test
}  // namespace JFPX_ABI
}  // namespace jfpx
