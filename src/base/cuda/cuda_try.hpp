/// Every CUDA call goes through JFPX_CUDA_TRY: failures become exceptions, none stays behind.
#pragma once

#include <jfpx/config.hpp>

#include <cuda_runtime_api.h>

#include <cstddef>

namespace jfpx {
inline namespace JFPX_ABI {
namespace cuda {

/// @throws DeviceError with the call, file:line and CUDA's name of the error.
[[noreturn]] JFPX_API void throw_device_error(cudaError_t error, const char* call, const char* file,
                                              int line);
/// @throws OutOfMemory with the bytes if `error` says so, DeviceError otherwise.
[[noreturn]] JFPX_API void throw_allocation_error(cudaError_t error, std::size_t bytes,
                                                  const char* what, const char* call,
                                                  const char* file, int line);

/// For tests: makes the CUDA call number `calls` from now (0: the next) of this thread fail with
/// `error` instead of being made, once. A negative number disarms.
JFPX_API void inject_fault(long calls, cudaError_t error);
/// The error that the next call must fail with; cudaSuccess nearly always.
JFPX_API cudaError_t take_injected_fault() noexcept;

}  // namespace cuda
}  // namespace JFPX_ABI
}  // namespace jfpx

/// The result of `call`, or of the fault that a test put in its place. Leaves no sticky error.
#define JFPX_CUDA_RESULT(call)                                              \
  [&]() -> cudaError_t {                                                    \
    const cudaError_t injected = ::jfpx::cuda::take_injected_fault();       \
    const cudaError_t result = injected == cudaSuccess ? (call) : injected; \
    if (result != cudaSuccess) static_cast<void>(cudaGetLastError());       \
    return result;                                                          \
  }()

#define JFPX_CUDA_TRY(call)                                                    \
  do {                                                                         \
    const cudaError_t jfpx_error = JFPX_CUDA_RESULT(call);                     \
    if (jfpx_error != cudaSuccess)                                             \
      ::jfpx::cuda::throw_device_error(jfpx_error, #call, __FILE__, __LINE__); \
  } while (false)

/// As JFPX_CUDA_TRY, for a call that takes `bytes` of memory for `what`.
#define JFPX_CUDA_TRY_ALLOC(call, bytes, what)                                                  \
  do {                                                                                          \
    const cudaError_t jfpx_error = JFPX_CUDA_RESULT(call);                                      \
    if (jfpx_error != cudaSuccess)                                                              \
      ::jfpx::cuda::throw_allocation_error(jfpx_error, bytes, what, #call, __FILE__, __LINE__); \
  } while (false)
