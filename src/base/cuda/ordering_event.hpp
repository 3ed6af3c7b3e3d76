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

  /// Later work of `second` waits for all earlier work of `first`.
  void order(cudaStream_t first, cudaStream_t second) {
    record(first);
    wait(second);
  }
  /// Later work of streams that wait() is called for waits for all earlier work of `stream`.
  void record(cudaStream_t stream) { JFPX_CUDA_TRY(cudaEventRecord(event_, stream)); }
  void wait(cudaStream_t stream) { JFPX_CUDA_TRY(cudaStreamWaitEvent(stream, event_, 0)); }
  /// The same for a stream that is being captured: each launch of the graph records the event, or
  /// waits for its last record, outside of the graph.
  void record_in_graph(cudaStream_t stream) {
    JFPX_CUDA_TRY(cudaEventRecordWithFlags(event_, stream, cudaEventRecordExternal));
  }
  void wait_in_graph(cudaStream_t stream) {
    JFPX_CUDA_TRY(cudaStreamWaitEvent(stream, event_, cudaEventWaitExternal));
  }

 private:
  cudaEvent_t event_ = nullptr;
};

}  // namespace cuda
}  // namespace JFPX_ABI
}  // namespace jfpx
