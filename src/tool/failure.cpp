/// Message and exit status of an exception.
#include "src/tool/failure.hpp"

#include <jfpx/error.hpp>

#include "src/tool/run_options.hpp"

#include <fmt/format.h>

#include <cstdio>
#include <new>

namespace jfpx {
inline namespace JFPX_ABI {
namespace tool {

int report_failure(const std::exception_ptr& failure, const std::string& prefix) {
  const auto print = [&](const char* message) {
    fmt::print(stderr, "jfpx: {}{}\n", prefix, message);
  };
  try {
    std::rethrow_exception(failure);
  } catch (const BackendUnavailable& error) {
    print(error.what());
    return kBackendUnavailable;
  } catch (const DeviceError& error) {
    print(error.what());
    return kBackendUnavailable;
  } catch (const std::bad_alloc&) {
    print("out of memory");
  } catch (const std::exception& error) {
    print(error.what());
  }
  return kBadUsage;
}

}  // namespace tool
}  // namespace JFPX_ABI
}  // namespace jfpx
