/// Conversion of CUDA errors to exceptions.
#include "src/base/cuda/cuda_try.hpp"

#include <jfpx/error.hpp>

#include <string>

namespace jfpx {
inline namespace JFPX_ABI {
namespace cuda {
namespace {

struct Fault {
  long calls_left = -1;
  cudaError_t error = cudaSuccess;
};
thread_local Fault fault;

std::string where(const char* call, const char* file, int line) {
  return std::string(call) + " at " + file + ":" + std::to_string(line);
}

}  // namespace

void throw_device_error(cudaError_t error, const char* call, const char* file, int line) {
  throw DeviceError("cuda: " + std::string(cudaGetErrorName(error)) + " (" +
                    cudaGetErrorString(error) + ") in " + where(call, file, line));
}

void throw_allocation_error(cudaError_t error, std::size_t bytes, const char* what,
                            const char* call, const char* file, int line) {
  if (error != cudaErrorMemoryAllocation) throw_device_error(error, call, file, line);
  throw OutOfMemory("cuda: no memory for " + std::to_string(bytes) + " bytes of " + what + " (" +
                    cudaGetErrorName(error) + " in " + where(call, file, line) + ")");
}

void inject_fault(long calls, cudaError_t error) { fault = {calls, error}; }

cudaError_t take_injected_fault() noexcept {
  if (fault.calls_left < 0 || fault.calls_left-- > 0) return cudaSuccess;
  return fault.error;
}

}  // namespace cuda
}  // namespace JFPX_ABI
}  // namespace jfpx
