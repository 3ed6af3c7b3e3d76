/// Benchmarks of the CUDA sphere search: on the device (graph replays between events) and from host
/// memory to host memory.
#include <jfpx/cuda/sphere_collider.hpp>

#include "bench/sphere_collider/inputs.hpp"
#include "src/base/cuda/device_buffer.hpp"
#include "src/base/cuda/probe.hpp"

#include <benchmark/benchmark.h>

#include <cstdio>
#include <cstring>
#include <string>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace bench {
namespace {

using namespace cuda;

/// Copy of an input in pinned memory, which transfers fastest.
struct HostSpheres {
  explicit HostSpheres(const std::vector<SphereInstance>& spheres) : count(spheres.size()) {
    memory.reserve(count + 1, "spheres on the host");
    std::memcpy(memory.data(), spheres.data(), count * sizeof(SphereInstance));
  }
  std::span<const SphereInstance> span() const { return {memory.data(), count}; }
  PinnedBuffer<SphereInstance> memory;
  std::size_t count;
};

/// Search with sufficient capacity, captured in a CUDA graph.
class DeviceSearch {
 public:
  DeviceSearch(const HostSpheres& host, SphereAlgorithm algorithm, bool pairs_only)
      : stream_(0), pool_(0), collider_(stream_.get(), 0, algorithm) {
    const std::size_t n = host.count;
    spheres_.reserve(pool_, stream_.get(), n, "spheres");
    count_.reserve(1, "count");
    JFPX_CUDA_TRY(cudaMemcpyAsync(spheres_.data(), host.memory.data(), n * sizeof(SphereInstance),
                                  cudaMemcpyHostToDevice, stream_.get()));
    std::size_t room = 4 * n + 64;
    do {
      collider_.reserve(n, room);
      contacts_.reserve(pool_, stream_.get(), room, "contacts");
      enqueue(n, pairs_only);
      JFPX_CUDA_TRY(cudaStreamSynchronize(stream_.get()));
      room = count_.data()->contacts;
    } while (count_.data()->complete == 0);
    cudaGraph_t graph = nullptr;
    JFPX_CUDA_TRY(cudaStreamBeginCapture(stream_.get(), cudaStreamCaptureModeThreadLocal));
    enqueue(n, pairs_only);
    JFPX_CUDA_TRY(cudaStreamEndCapture(stream_.get(), &graph));
    JFPX_CUDA_TRY(cudaGraphInstantiate(&graph_, graph, 0));
    JFPX_CUDA_TRY(cudaGraphDestroy(graph));
    for (cudaEvent_t& e : events_) JFPX_CUDA_TRY(cudaEventCreate(&e));
  }
  ~DeviceSearch() {
    static_cast<void>(cudaStreamSynchronize(stream_.get()));
    static_cast<void>(cudaGraphExecDestroy(graph_));
    for (cudaEvent_t e : events_) static_cast<void>(cudaEventDestroy(e));
  }
  DeviceSearch(const DeviceSearch&) = delete;
  DeviceSearch& operator=(const DeviceSearch&) = delete;

  /// Mean number of seconds per search, over `repeats` consecutive searches.
  double seconds(int repeats) {
    JFPX_CUDA_TRY(cudaEventRecord(events_[0], stream_.get()));
    for (int i = 0; i < repeats; ++i) JFPX_CUDA_TRY(cudaGraphLaunch(graph_, stream_.get()));
    JFPX_CUDA_TRY(cudaEventRecord(events_[1], stream_.get()));
    JFPX_CUDA_TRY(cudaEventSynchronize(events_[1]));
    float ms = 0;
    JFPX_CUDA_TRY(cudaEventElapsedTime(&ms, events_[0], events_[1]));
    return ms * 1e-3 / repeats;
  }
  std::uint64_t contacts() const { return count_.data()->contacts; }

 private:
  void enqueue(std::size_t n, bool pairs_only) {
    if (pairs_only) {
      collider_.find_pairs(spheres_.data(), n, reinterpret_cast<SpherePair*>(contacts_.data()),
                           contacts_.capacity(), count_.data());
    } else {
      collider_.find_contacts(spheres_.data(), n, contacts_.data(), contacts_.capacity(),
                              count_.data());
    }
  }

  OwnedStream stream_;
  MemoryPool pool_;
  DeviceSphereCollider collider_;
  DeviceBuffer<SphereInstance> spheres_;
  DeviceBuffer<SphereContact> contacts_;
  PinnedBuffer<ContactCount> count_;
  cudaGraphExec_t graph_ = nullptr;
  cudaEvent_t events_[2] = {};
};

void report(benchmark::State& state, std::size_t n, std::uint64_t contacts) {
  state.counters["spheres"] = static_cast<double>(n);
  state.counters["contacts"] = static_cast<double>(contacts);
}

void on_device(benchmark::State& state, const Input& input, std::size_t n,
               SphereAlgorithm algorithm, bool pairs_only) {
  const HostSpheres host(input.make(n));
  DeviceSearch search(host, algorithm, pairs_only);
  const int repeats = search.seconds(1) > 2e-3 ? 1 : 20;
  search.seconds(repeats);
  for (auto _ : state) state.SetIterationTime(search.seconds(repeats));
  report(state, n, search.contacts());
}

void host_to_host(benchmark::State& state, const Input& input, std::size_t n) {
  const HostSpheres host(input.make(n));
  const auto collider = make_sphere_collider({.backend = Backend::cuda});
  std::size_t contacts = 0;
  for (int i = 0; i < 3; ++i) contacts = collider->find_contacts(host.span()).size();
  for (auto _ : state) contacts = collider->find_contacts(host.span()).size();
  report(state, n, contacts);
}

/// Only the copies that host_to_host requires.
void copies_alone(benchmark::State& state, const Input& input, std::size_t n) {
  const HostSpheres host(input.make(n));
  const std::size_t contacts =
      make_sphere_collider({.backend = Backend::cuda})->find_contacts(host.span()).size();
  const OwnedStream stream(0);
  const MemoryPool pool(0);
  DeviceBuffer<SphereInstance> spheres;
  DeviceBuffer<SphereContact> on_device;
  PinnedBuffer<SphereContact> on_host;
  spheres.reserve(pool, stream.get(), n, "spheres");
  on_device.reserve(pool, stream.get(), contacts, "contacts");
  on_host.reserve(contacts, "contacts on the host");
  for (auto _ : state) {
    JFPX_CUDA_TRY(cudaMemcpyAsync(spheres.data(), host.memory.data(), n * sizeof(SphereInstance),
                                  cudaMemcpyHostToDevice, stream.get()));
    JFPX_CUDA_TRY(cudaMemcpyAsync(on_host.data(), on_device.data(),
                                  contacts * sizeof(SphereContact), cudaMemcpyDeviceToHost,
                                  stream.get()));
    JFPX_CUDA_TRY(cudaStreamSynchronize(stream.get()));
  }
  report(state, n, contacts);
}

benchmark::internal::Benchmark* add(const std::string& name, auto&& run) {
  return benchmark::RegisterBenchmark(name.c_str(), run)->Unit(benchmark::kMicrosecond);
}

void add_on_device(const std::string& kind, const Input& input, std::size_t n,
                   SphereAlgorithm algorithm, bool pairs_only = false) {
  add("device/" + kind + "/" + std::string(input.name) + "/" + std::to_string(n),
      [=, &input](benchmark::State& s) { on_device(s, input, n, algorithm, pairs_only); })
      ->UseManualTime();
}

void register_all() {
  const Input& gas = input("gas");
  for (const std::size_t n : {448, 1000, 2000, 4096, 10000, 20000, 32000, 100000, 260000, 270000,
                              400000, 1000000, 10000000}) {
    add_on_device("automatic", gas, n, SphereAlgorithm::automatic);
    if (n > 1000 && n <= 32000) add_on_device("all_pairs", gas, n, SphereAlgorithm::all_pairs);
    if (n <= 32000) add_on_device("grid", gas, n, SphereAlgorithm::grid);
  }
  add_on_device("pairs_only", gas, 1000000, SphereAlgorithm::automatic, true);
  for (const std::size_t n : {10000, 100000, 1000000}) {
    add_on_device("pairs_only", input("crowded"), n, SphereAlgorithm::automatic, true);
  }
  add_on_device("automatic", input("overlap"), 4096, SphereAlgorithm::automatic);
  for (const Input& i : inputs()) {
    if (i.name != "gas" && i.name != "overlap")
      add_on_device("automatic", i, 1000000, SphereAlgorithm::automatic);
  }
  for (const std::size_t n : {448, 10000, 100000, 1000000}) {
    add("host/automatic/gas/" + std::to_string(n), [=, &gas](benchmark::State& s) {
      host_to_host(s, gas, n);
    })->UseRealTime();
    add("host/copies_alone/gas/" + std::to_string(n), [=, &gas](benchmark::State& s) {
      copies_alone(s, gas, n);
    })->UseRealTime();
  }
}

}  // namespace
}  // namespace bench
}  // namespace JFPX_ABI
}  // namespace jfpx

int main(int argc, char** argv) {
  const jfpx::BackendStatus status = jfpx::cuda::probe();
  if (!status.usable) {
    std::fprintf(stderr, "cuda: %s\n", status.reason.c_str());
    return 3;
  }
  benchmark::AddCustomContext("device", status.device);
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 2;
  jfpx::bench::register_all();
  benchmark::RunSpecifiedBenchmarks();
  return 0;
}
