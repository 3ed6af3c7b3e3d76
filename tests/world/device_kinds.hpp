/// The devices for tests of queues: the host, and a GPU if there is one.
#pragma once

#include "src/world/world_impl.hpp"
#include "tests/world/cuda_devices.hpp"
#include "tests/world/host_device.hpp"
#include "tests/world/several_blocks.hpp"

#include <gtest/gtest.h>
#if JFPX_HAS_CUDA
#include <cuda_runtime_api.h>
#endif

#include <cstring>
#include <functional>
#include <memory>
#include <ostream>
#include <stdexcept>
#include <string>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace test {

inline HostDevice& host_device_of(World* world) {
  DeviceWorld* device = WorldAccess::impl(*world).device.get();
  return static_cast<device::DeviceStep<HostDevice>*>(device)->device();
}

struct DeviceKind {
  friend void PrintTo(const DeviceKind& kind, std::ostream* out) { *out << kind.name; }
  std::string name;
  bool is_cuda = false;
  std::uint32_t most_in_one_block = soft_step::kMostBodiesInOneBlock;
  std::function<std::unique_ptr<DeviceWorld>(const Scene&)> make;
  /// Captures the work that `work` enqueues on a stream. @returns a function that launches the
  /// graph on the default stream. Null: steps cannot be captured.
  std::function<std::function<void()>(World*, const std::function<void(cuda::Stream)>& work)>
      capture;
};

inline std::function<void()> capture_on_host(World* world,
                                             const std::function<void(cuda::Stream)>& work) {
  const auto graph = std::make_shared<HostDevice::Graph>();
  struct Scope {
    Scope(HostDevice* on, HostDevice::Graph* to) : device(on) { device->set_graph(to); }
    ~Scope() { device->set_graph(nullptr); }
    HostDevice* device;
  } const scope(&host_device_of(world), graph.get());
  work(nullptr);
  return [graph] { graph->launch(); };
}

#if JFPX_HAS_CUDA
inline void require(cudaError_t error) {
  if (error != cudaSuccess) throw std::runtime_error(cudaGetErrorString(error));
}

/// A stream, and the graph that was captured from it.
struct CapturedGraph {
  CapturedGraph() { require(cudaStreamCreateWithFlags(&stream, cudaStreamNonBlocking)); }
  ~CapturedGraph() {
    if (graph != nullptr) cudaGraphExecDestroy(graph);
    cudaStreamDestroy(stream);
  }
  CapturedGraph(const CapturedGraph&) = delete;
  CapturedGraph& operator=(const CapturedGraph&) = delete;
  cudaStream_t stream = nullptr;
  cudaGraphExec_t graph = nullptr;
};

inline std::function<void()> capture_on_cuda(World*,
                                             const std::function<void(cuda::Stream)>& work) {
  const auto made = std::make_shared<CapturedGraph>();
  cudaGraph_t captured = nullptr;
  require(cudaStreamBeginCapture(made->stream, cudaStreamCaptureModeGlobal));
  try {
    work(made->stream);
  } catch (...) {
    require(cudaStreamEndCapture(made->stream, &captured));
    cudaGraphDestroy(captured);
    throw;
  }
  require(cudaStreamEndCapture(made->stream, &captured));
  const cudaError_t error = cudaGraphInstantiate(&made->graph, captured, 0);
  cudaGraphDestroy(captured);
  require(error);
  return [made] { require(cudaGraphLaunch(made->graph, nullptr)); };
}
#endif

/// Without a GPU, only the host, unless JFPX_REQUIRE_CUDA is set.
inline std::vector<DeviceKind> device_kinds() {
  std::vector<DeviceKind> kinds{
      {.name = "Host", .make = make_host_device_world, .capture = capture_on_host}};
#if JFPX_HAS_CUDA
  for (const CudaDevices& devices : one_cuda_device()) {
    kinds.push_back(
        {.name = devices.name, .is_cuda = true, .make = devices, .capture = capture_on_cuda});
  }
#endif
  for (std::size_t i = kinds.size(); i-- > 0;) {
    kinds.push_back(kinds[i]);
    kinds.back().name += "WithBlocks";
    kinds.back().most_in_one_block = 8;
  }
#if JFPX_HAS_CUDA
  for (const CudaDevices& devices : several_cuda_devices()) {
    kinds.push_back({.name = devices.name,
                     .is_cuda = true,
                     .most_in_one_block = 8,
                     .make = devices,
                     .capture = nullptr});
  }
#endif
  return kinds;
}

/// [bytes], GPU memory in use, including other processes; 0 on the host.
inline std::size_t device_bytes_in_use([[maybe_unused]] const DeviceKind& kind) {
  std::size_t free = 0, total = 0;
#if JFPX_HAS_CUDA
  if (kind.is_cuda) require(cudaMemGetInfo(&free, &total));
#endif
  return total - free;
}

#if JFPX_HAS_CUDA
/// A stream that the program has created, or the default stream; no stream on the host.
class StreamOfUser {
 public:
  explicit StreamOfUser(const DeviceKind& kind, bool is_default = false)
      : is_cuda_(kind.is_cuda), is_own_(kind.is_cuda && !is_default) {
    if (is_own_) require(cudaStreamCreateWithFlags(&stream_, cudaStreamNonBlocking));
  }
  ~StreamOfUser() {
    if (is_own_) cudaStreamDestroy(stream_);
  }
  StreamOfUser(const StreamOfUser&) = delete;
  StreamOfUser& operator=(const StreamOfUser&) = delete;

  cuda::Stream get() const { return stream_; }
  /// Copies from the device in the order of the stream, and waits.
  void read(void* to, const void* from, std::size_t bytes) const {
    if (!is_cuda_) {
      std::memcpy(to, from, bytes);
      return;
    }
    require(cudaMemcpyAsync(to, from, bytes, cudaMemcpyDeviceToHost, stream_));
    require(cudaStreamSynchronize(stream_));
  }

 private:
  bool is_cuda_, is_own_;
  cuda::Stream stream_ = nullptr;
};
#else
class StreamOfUser {
 public:
  explicit StreamOfUser(const DeviceKind&, bool = false) {}
  cuda::Stream get() const { return nullptr; }
  void read(void* to, const void* from, std::size_t bytes) const { std::memcpy(to, from, bytes); }
};
#endif

}  // namespace test
}  // namespace JFPX_ABI
}  // namespace jfpx
