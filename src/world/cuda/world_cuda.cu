/// The world on a CUDA device: launches of the programs of a step. Their kernels are compiled in
/// files of their own (program_kernel.hpp).
#include "src/base/cuda/device_buffer.hpp"
#include "src/base/cuda/device_code.hpp"
#include "src/base/cuda/ordering_event.hpp"
#include "src/base/parallel_for.hpp"
#include "src/sphere_collider/cuda/device_search.hpp"
#include "src/world/cuda/grid_team.cuh"
#include "src/world/cuda/program_kernel.hpp"
#include "src/world/cuda/world_cuda.hpp"
#include "src/world/device/device_step.hpp"

#include <algorithm>
#include <cstddef>
#include <cstring>
#include <string>
#include <tuple>
#include <utility>

namespace jfpx {
inline namespace JFPX_ABI {
namespace cuda {
namespace {

namespace tuning = device::tuning;

/// The stream, the memory and the launches of a DeviceStep.
class CudaDevice {
 public:
  template <class T>
  using Buffer = DeviceBuffer<T>;

  explicit CudaDevice(int device)
      : device_(usable_device(device)),
        stream_(device_),
        pool_(device_),
        marks_{OwnedEvent(device_), OwnedEvent(device_), OwnedEvent(device_), OwnedEvent(device_)},
        order_(device_),
        search_(stream_.get(), device_, SphereAlgorithm::automatic) {
    const DeviceGuard guard(device_);
    JFPX_CUDA_TRY(
        cudaDeviceGetAttribute(&multiprocessors_, cudaDevAttrMultiProcessorCount, device_));
    // Sized for every program, because captured graphs contain the address.
    const unsigned blocks = tuning::kMost * static_cast<unsigned>(multiprocessors_);
    scratch_.reserve(pool_, stream_.get(), GridTeam::scratch_words(blocks), "scratch memory");
  }

  int number() const noexcept { return device_; }
  Stream stream() const noexcept { return stream_.get(); }

  template <class T>
  void reserve(Buffer<T>* buffer, std::size_t count, const char* what) {
    if (count <= buffer->capacity()) return;
    const DeviceGuard guard(device_);
    buffer->reserve_geometric(pool_, stream_.get(), count, what);
  }
  template <class T>
  void reserve_exactly(Buffer<T>* buffer, std::size_t count, const char* what) {
    if (count <= buffer->capacity()) return;
    const DeviceGuard guard(device_);
    buffer->reserve(pool_, stream_.get(), count, what);
  }
  /// Loads a program, so that it can be launched while a stream is being captured.
  template <class Program>
  void load() {
    const DeviceGuard guard(device_);
    limits_of<Program>();
  }
  void release_unused() {
    wait();
    JFPX_CUDA_TRY(cudaMemPoolTrimTo(pool_.get(), 0));
  }
  template <class T>
  void upload(T* to, const T* from, std::size_t count) {
    transfer(to, from, count, cudaMemcpyHostToDevice);
  }
  template <class T>
  void download(T* to, const T* from, std::size_t count) {
    transfer(to, from, count, cudaMemcpyDeviceToHost);
  }
  /// Copies through page-locked memory and then with the pool. CUDA copies to pageable memory with
  /// one thread and in small pieces.
  void fetch(const device::HostCopies& copies, ThreadPool* pool) {
    const DeviceGuard guard(device_);
    std::size_t bytes = 0;
    for (const device::HostCopy& copy : copies) bytes += copy.bytes;
    try {
      staging_.reserve_geometric(bytes, "the states of a world");
    } catch (const OutOfMemory&) {  // page-locked memory is exhausted
      for (const device::HostCopy& copy : copies) {
        transfer(static_cast<std::byte*>(copy.to), static_cast<const std::byte*>(copy.from),
                 copy.bytes, cudaMemcpyDeviceToHost);
      }
      wait();
      return;
    }
    std::byte* at = staging_.data();
    for (const device::HostCopy& copy : copies) {
      transfer(at, static_cast<const std::byte*>(copy.from), copy.bytes, cudaMemcpyDeviceToHost);
      at += copy.bytes;
    }
    wait();
    constexpr std::size_t kBytesPerTask = std::size_t{1} << 18;
    const std::byte* from = staging_.data();
    for (const device::HostCopy& copy : copies) {
      parallel_for(pool, copy.bytes, kBytesPerTask, [&](std::size_t first, std::size_t last) {
        std::memcpy(static_cast<std::byte*>(copy.to) + first, from + first, last - first);
      });
      from += copy.bytes;
    }
  }
  template <class T>
  void copy(T* to, const T* from, std::size_t count) {
    transfer(to, from, count, cudaMemcpyDeviceToDevice);
  }

  void reserve_pairs(std::size_t n, std::size_t capacity) { search_.reserve(n, capacity); }
  void find_pairs(const SphereInstance* spheres, std::size_t n, SpherePair* pairs,
                  std::size_t capacity, ContactCount* count) {
    search_.find({.spheres = spheres, .n = static_cast<std::uint32_t>(n)},
                 {.pairs = pairs, .capacity = capacity, .count = count}, target_);
  }

  template <class Program>
  void run(const Program& program, std::size_t items) {
    const DeviceGuard guard(device_);
    const Launch& limits = limits_of<Program>();
    const std::size_t wanted = (items + GridTeam::kThreads - 1) / GridTeam::kThreads;
    std::size_t most = limits.most_blocks;
    if constexpr (requires { Program::kItemsPerThread; }) {
      most = std::clamp(items / (GridTeam::kThreads * Program::kItemsPerThread),
                        static_cast<std::size_t>(multiprocessors_), most);
    }
    auto blocks = static_cast<unsigned>(std::clamp<std::size_t>(wanted, 1, most));
    if (limits.has_clusters && blocks <= 2 * tuning::kClusterBlocks) {
      blocks = std::min(blocks, tuning::kClusterBlocks);
    }
    bool is_cluster = limits.has_clusters && blocks > 1 && blocks <= tuning::kClusterBlocks;
    cudaLaunchAttribute attribute{};
    if (is_cluster) {
      attribute.id = cudaLaunchAttributeClusterDimension;
      attribute.val.clusterDim = {blocks, 1, 1};
    } else {
      attribute.id = cudaLaunchAttributeCooperative;
      attribute.val.cooperative = 1;
    }
    cudaLaunchConfig_t config{};
    config.gridDim = blocks;
    config.blockDim = GridTeam::kThreads;
    config.dynamicSmemBytes = shared_bytes<Program>();
    config.stream = target_;
    config.attrs = &attribute;
    config.numAttrs = 1;
    std::uint32_t* scratch = scratch_.data();
    void* arguments[] = {const_cast<Program*>(&program), &scratch, &is_cluster};
    JFPX_CUDA_TRY(cudaLaunchKernelExC(&config, program_kernel<Program>(), arguments));
  }

  void wait() {
    const DeviceGuard guard(device_);
    JFPX_CUDA_TRY(cudaStreamSynchronize(stream_.get()));
  }
  /// Graphs may have been launched on any stream.
  void wait_for_graphs() {
    const DeviceGuard guard(device_);
    JFPX_CUDA_TRY(cudaDeviceSynchronize());
  }

  void fork(Stream stream) {
    const DeviceGuard guard(device_);
    order_.order(stream, stream_.get());
  }
  void join(Stream stream) {
    const DeviceGuard guard(device_);
    order_.order(stream_.get(), stream);
  }

  bool is_capturing(Stream stream) const {
    const DeviceGuard guard(device_);
    cudaStreamCaptureStatus status = cudaStreamCaptureStatusNone;
    JFPX_CUDA_TRY(cudaStreamIsCapturing(stream, &status));
    return status != cudaStreamCaptureStatusNone;
  }
  /// Captures the work from the user's stream, not from the stream of the world.
  template <class Work>
  void capture(Stream stream, const Work& work) {
    const DeviceGuard guard(device_);
    struct Target {
      ~Target() { *target = before; }
      Stream *target, before;
    } const target{&target_, std::exchange(target_, stream)};
    work();
  }

  void mark(int i) { JFPX_CUDA_TRY(cudaEventRecord(marks_[i].get(), stream_.get())); }
  /// 0 if recording an event has failed; the step is not affected.
  double elapsed_ms(int from, int to) const noexcept {
    float result = 0;
    if (cudaEventElapsedTime(&result, marks_[from].get(), marks_[to].get()) == cudaSuccess) {
      return static_cast<double>(result);
    }
    static_cast<void>(cudaGetLastError());
    return 0;
  }

 private:
  /// Limits of the launches of a program.
  struct Launch {
    std::size_t most_blocks = 0;  ///< number of resident blocks; 0: not yet known
    bool has_clusters = false;
  };

  /// At least the static shared memory of a program.
  static constexpr std::size_t kStaticShared = 4096;

  /// Bytes of shared memory of a block.
  template <class Program>
  static constexpr std::size_t shared_bytes() {
    if constexpr (requires { Program::kSharedBytes; }) return Program::kSharedBytes;
    return 0;
  }

  template <class Program>
  const Launch& limits_of() {
    static_assert(Program::kBlocksPerMultiprocessor <= tuning::kMost);
    Launch& limits = std::get<Limits<Program>>(limits_);
    if (limits.most_blocks > 0) return limits;
    const void* const kernel = program_kernel<Program>();
    int resident = 0;
    constexpr std::size_t kShared = shared_bytes<Program>();
    int most_shared = 0;
    JFPX_CUDA_TRY(
        cudaDeviceGetAttribute(&most_shared, cudaDevAttrMaxSharedMemoryPerBlockOptin, device_));
    if (kShared + kStaticShared > static_cast<std::size_t>(most_shared)) {
      throw DeviceError(
          "a world with more than " + std::to_string(soft_step::kMostBodiesInOneBlock) +
          " movable bodies needs " + std::to_string(kShared + kStaticShared) +
          " bytes of shared memory for a block; this GPU has " + std::to_string(most_shared));
    }
    JFPX_CUDA_TRY(cudaFuncSetAttribute(kernel, cudaFuncAttributeMaxDynamicSharedMemorySize,
                                       static_cast<int>(kShared)));
    JFPX_CUDA_TRY(cudaOccupancyMaxActiveBlocksPerMultiprocessor(&resident, kernel,
                                                                GridTeam::kThreads, kShared));
    limits.has_clusters = has_hopper_code();
    if (limits.has_clusters) {
      JFPX_CUDA_TRY(
          cudaFuncSetAttribute(kernel, cudaFuncAttributeNonPortableClusterSizeAllowed, 1));
    }
    limits.most_blocks =
        std::min<std::size_t>(static_cast<unsigned>(resident), Program::kBlocksPerMultiprocessor) *
        static_cast<unsigned>(multiprocessors_);
    return limits;
  }
  template <class Program>
  struct Limits : Launch {};

  template <class T>
  void transfer(T* to, const T* from, std::size_t count, cudaMemcpyKind kind) {
    if (count == 0) return;
    const DeviceGuard guard(device_);
    JFPX_CUDA_TRY(cudaMemcpyAsync(to, from, count * sizeof(T), kind, stream_.get()));
  }

  int device_;
  OwnedStream stream_;
  Stream target_ = stream_.get();  ///< of launches: `stream_`, or one that is being captured
  MemoryPool pool_;
  OwnedEvent marks_[device::kMarks];
  OrderingEvent order_;
  DeviceSearch search_;
  DeviceBuffer<std::uint32_t> scratch_;
  PinnedBuffer<std::byte> staging_;
  int multiprocessors_ = 0;
  std::tuple<Limits<device::ForceProgram>, Limits<device::BoundsProgram>,
             Limits<device::SphereProgram>, Limits<device::ShapeProgram>,
             Limits<device::MatchProgram>, Limits<device::PrepareProgram>,
             Limits<device::SolveProgram<soft_step::kContactRowKinds>>,
             Limits<device::SolveProgram<soft_step::kRowKinds>>,
             Limits<device::BlockSolveProgram<device::kSphereRowKinds>>,
             Limits<device::BlockSolveProgram<soft_step::kContactRowKinds>>,
             Limits<device::BlockSolveProgram<soft_step::kRowKinds>>, Limits<device::CommitProgram>,
             Limits<device::EditProgram>, Limits<device::MergeProgram>>
      limits_;
};

}  // namespace

std::unique_ptr<DeviceWorld> make_world(const Scene& scene, int device) {
  return std::make_unique<device::DeviceStep<CudaDevice>>(scene,
                                                          std::make_unique<CudaDevice>(device));
}

}  // namespace cuda
}  // namespace JFPX_ABI
}  // namespace jfpx
