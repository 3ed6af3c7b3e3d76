/// JFPX_CUDA_TRY, which wraps every CUDA call: converts errors to exceptions and clears them.
#pragma once

#include <jfpx/config.hpp>

#include <cuda_runtime_api.h>

#include <cstddef>

namespace jfpx {
inline namespace JFPX_ABI {
namespace cuda {

/// @throws DeviceError with the call, file:line and CUDA's name of the error
[[noreturn]] JFPX_API void throw_device_error(cudaError_t error, const char* call, const char* file,
                                              int line);
/// @throws OutOfMemory with the number of bytes if `error` is a failed allocation, otherwise
/// DeviceError
[[noreturn]] JFPX_API void throw_allocation_error(cudaError_t error, std::size_t bytes,
                                                  const char* what, const char* call,
                                                  const char* file, int line);

/// Fault injection for tests. The next `calls` CUDA calls of this thread are executed; the
/// following call is not executed and returns `error`. A negative number disables the injection.
JFPX_API void inject_fault(long calls, cudaError_t error);
/// Counts a CUDA call. Returns the error that a test has injected for it, otherwise cudaSuccess.
JFPX_API cudaError_t take_injected_fault() noexcept;

}  // namespace cuda
}  // namespace JFPX_ABI
}  // namespace jfpx

/// The result of `call`, or the error that a test has injected. Clears CUDA's last error of the
/// thread, so that a later cudaGetLastError() does not report it.
#define JFPX_CUDA_RESULT(call)                                              \
  [&]() -> cudaError_t {                                                    \
    const cudaError_t injected = ::jfpx::cuda::take_injected_fault();       \
    const cudaError_t result = injected == cudaSuccess ? (call) : injected; \
    if (result != cudaSuccess) static_cast<void>(cudaGetLastError());       \
    return result;                                                          \
  }()

/// Executes a CUDA call. @throws DeviceError if it fails
#define JFPX_CUDA_TRY(call)                                                    \
  do {                                                                         \
    const cudaError_t jfpx_error = JFPX_CUDA_RESULT(call);                     \
    if (jfpx_error != cudaSuccess)                                             \
      ::jfpx::cuda::throw_device_error(jfpx_error, #call, __FILE__, __LINE__); \
  } while (false)

/// JFPX_CUDA_TRY for a call that allocates `bytes` bytes for `what`.
#define JFPX_CUDA_TRY_ALLOC(call, bytes, what)                                                  \
  do {                                                                                          \
    const cudaError_t jfpx_error = JFPX_CUDA_RESULT(call);                                      \
    if (jfpx_error != cudaSuccess)                                                              \
      ::jfpx::cuda::throw_allocation_error(jfpx_error, bytes, what, #call, __FILE__, __LINE__); \
  } while (false)
