/// Events that order the work of two streams.
#pragma once

#include "src/base/cuda/device_buffer.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace cuda {

/// Owner of an event that only orders streams.
class OrderingEvent {
 public:
  explicit OrderingEvent(int device) {
    const DeviceGuard guard(device);
    JFPX_CUDA_TRY(cudaEventCreateWithFlags(&event_, cudaEventDisableTiming));
  }
  ~OrderingEvent() { static_cast<void>(cudaEventDestroy(event_)); }
  OrderingEvent(const OrderingEvent&) = delete;
  OrderingEvent& operator=(const OrderingEvent&) = delete;

  /// Makes later work of `second` wait for all earlier work of `first`.
  void order(cudaStream_t first, cudaStream_t second) {
    JFPX_CUDA_TRY(cudaEventRecord(event_, first));
    JFPX_CUDA_TRY(cudaStreamWaitEvent(second, event_, 0));
  }

 private:
  cudaEvent_t event_ = nullptr;
};

}  // namespace cuda
}  // namespace JFPX_ABI
}  // namespace jfpx
