/// The world on a CUDA device: launches of the programs of a step. Their kernels are compiled in
/// files of their own (program_kernel.hpp).
#include "src/base/cuda/device_buffer.hpp"
#include "src/base/cuda/device_code.hpp"
#include "src/base/cuda/mapped_memory.hpp"
#include "src/base/cuda/ordering_event.hpp"
#include "src/base/cuda/probe.hpp"
#include "src/base/parallel_for.hpp"
#include "src/sphere_collider/cuda/device_search.hpp"
#include "src/world/cuda/grid_team.cuh"
#include "src/world/cuda/program_kernel.hpp"
#include "src/world/cuda/world_cuda.hpp"
#include "src/world/device/device_step.hpp"

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <cstring>
#include <limits>
#include <memory>
#include <mutex>
#include <numeric>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace cuda {
namespace {

namespace tuning = device::tuning;

/// An array that all devices of a world share.
class SharedArray {
 public:
  /// The arrays of a world, which must outlive them.
  using List = std::vector<SharedArray*>;

  /// @param first see PageLayout::parts_of_pages()
  /// @param stream in which the devices use the memory
  SharedArray(List* all, const std::vector<int>& devices, std::size_t bytes,
              const PageLayout& layout, const std::vector<double>& first, const char* what,
              Stream stream)
      : all_(all),
        layout_(layout),
        bytes_(bytes),
        what_(what),
        stream_(stream),
        memory_(devices, bytes, layout.parts_of_pages(bytes, MappedMemory::kPage, first), what) {
    all_->push_back(this);
  }
  ~SharedArray() {
    std::erase(*all_, this);
    static_cast<void>(cudaStreamSynchronize(stream_));
  }
  SharedArray(const SharedArray&) = delete;
  SharedArray& operator=(const SharedArray&) = delete;

  void* data() const noexcept { return memory_.data(); }
  const PageLayout& layout() const noexcept { return layout_; }
  /// Moves pages, while no device uses them.
  void move(const std::vector<int>& devices, const std::vector<double>& first) {
    memory_.move(devices, layout_.parts_of_pages(bytes_, MappedMemory::kPage, first), what_,
                 stream_);
  }

 private:
  List* all_;
  PageLayout layout_;
  std::size_t bytes_;
  const char* what_;
  Stream stream_;
  MappedMemory memory_;
};

/// Memory of the first device of a world, or of all of them.
class WorldMemory {
 public:
  WorldMemory() = default;
  explicit WorldMemory(DeviceMemory memory) : of_one_(std::move(memory)) {}
  explicit WorldMemory(std::unique_ptr<SharedArray> array) : of_all_(std::move(array)) {}
  void* data() const noexcept { return of_all_ != nullptr ? of_all_->data() : of_one_.data(); }

 private:
  DeviceMemory of_one_;
  std::unique_ptr<SharedArray> of_all_;
};

/// Orders the programs of all worlds on several devices. Otherwise, the program of one world could
/// occupy one device, and that of another world another one, and both would wait for ever for the
/// rest of their threads.
class SharedDevices {
 public:
  static SharedDevices& instance() {
    static SharedDevices devices;
    return devices;
  }
  /// Calls launch() after the work that has been launched so far.
  /// @param world identifies the caller; its own programs are in order already
  /// @param first stream of the first device, whose work ends after that of the others
  /// @param all the streams of all devices
  template <class Launch>
  void run(const void* world, int device, Stream first, const std::vector<Stream>& all,
           const Launch& launch) {
    const std::lock_guard lock(mutex_);
    if (last_ != nullptr && last_ != world) {
      const DeviceGuard guard(last_device_);
      OrderingEvent event(last_device_);
      for (const Stream stream : all) event.order(last_stream_, stream);
    }
    last_ = world;
    last_device_ = device;
    last_stream_ = first;
    launch();
  }
  /// To be called before the streams of a world are destroyed, after all of its work.
  void leave(const void* world) {
    const std::lock_guard lock(mutex_);
    if (last_ == world) last_ = nullptr;
  }

 private:
  std::mutex mutex_;
  const void* last_ = nullptr;
  int last_device_ = 0;
  Stream last_stream_ = nullptr;
};

/// The devices of a world. @throws BackendUnavailable if they cannot share memory
std::vector<int> usable_devices(const std::vector<int>& devices) {
  for (const int device : devices) usable_device(device);
  if (const std::string reason = why_not_shared(devices); !reason.empty()) {
    throw BackendUnavailable(reason);
  }
  return devices;
}

/// The streams, the memory and the launches of a DeviceStep. Programs that several devices share
/// begin and end together, so the stream of the first device orders all work.
class CudaDevice {
 public:
  template <class T>
  class Buffer {
   public:
    T* data() const noexcept { return array_.data(); }
    std::size_t capacity() const noexcept { return array_.capacity(); }
    void swap(Buffer& other) noexcept { array_.swap(other.array_); }

   private:
    friend CudaDevice;
    GrowableArray<T, WorldMemory> array_;
  };

  /// @param devices by part; a device may occur more than once
  explicit CudaDevice(const std::vector<int>& devices)
      : devices_(usable_devices(devices)),
        device_(devices_[0]),
        stream_(device_),
        pool_(device_),
        marks_{OwnedEvent(device_), OwnedEvent(device_), OwnedEvent(device_), OwnedEvent(device_)},
        order_(device_),
        search_(stream_.get(), device_, SphereAlgorithm::automatic) {
    multiprocessors_ = std::numeric_limits<int>::max();
    for (const int device : devices_) {
      int count = 0;
      JFPX_CUDA_TRY(cudaDeviceGetAttribute(&count, cudaDevAttrMultiProcessorCount, device));
      multiprocessors_ = std::min(multiprocessors_, count);
    }
    if (devices_.size() > 1) start_parts();
    const DeviceGuard guard(device_);
    // Sized for every program, because captured graphs contain the address.
    const unsigned blocks = parts() * tuning::kMost * static_cast<unsigned>(multiprocessors_);
    scratch_.reserve(pool_, stream_.get(), GridTeam::scratch_words(blocks), "scratch memory");
    if (parts() == 1) state_.reserve(pool_, stream_.get(), 1, "counters");
  }
  ~CudaDevice() {
    if (devices_.size() == 1) return;
    for (const Stream stream : streams_) static_cast<void>(cudaStreamSynchronize(stream));
    SharedDevices::instance().leave(this);
  }

  int number() const noexcept { return device_; }
  Stream stream() const noexcept { return stream_.get(); }
  std::uint32_t parts() const noexcept { return static_cast<std::uint32_t>(devices_.size()); }
  device::PartState* part_state(std::uint32_t part) const noexcept {
    return parts() == 1 ? state_.data() : &memory_of(part)->state;
  }
  /// Divides the arrays that are allocated later, and those that exist.
  void divide(std::uint32_t parts, const device::Divisions& divisions) {
    shares_memory_ = parts > 1;
    divisions_ = divisions;
    if (!shares_memory_) return;
    wait();
    const DeviceGuard guard(device_);
    for (SharedArray* array : shared_arrays_) {
      try {
        array->move(devices_, first_items(array->layout()));
      } catch (const OutOfMemory&) {  // its pages stay where they are, which only costs time
        static_cast<void>(cudaGetLastError());
      }
    }
  }

  template <class T>
  void reserve(Buffer<T>* buffer, std::size_t count, const char* what, const PageLayout& layout) {
    if (count <= buffer->capacity()) return;
    replace(buffer, geometric_capacity(buffer->capacity(), count), count, what, layout);
  }
  template <class T>
  void reserve_exactly(Buffer<T>* buffer, std::size_t count, const char* what,
                       const PageLayout& layout) {
    if (count > buffer->capacity()) replace(buffer, count, count, what, layout);
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

  /// @param parts 1, or parts()
  template <class Program>
  void run(const Program& program, std::size_t items, std::uint32_t parts = 1) {
    const DeviceGuard guard(device_);
    const Launch& limits = limits_of<Program>();
    const std::size_t share = items / parts;
    std::size_t wanted = (share + GridTeam::kThreads - 1) / GridTeam::kThreads;
    if constexpr (requires { Program::kThreadsPerItem; }) {
      wanted = std::max(wanted, std::min(wanted * Program::kThreadsPerItem,
                                         static_cast<std::size_t>(multiprocessors_)));
    }
    std::size_t most = parts == 1 ? limits.most_blocks : limits.most_blocks_of_part;
    if constexpr (requires { Program::kItemsPerThread; }) {
      if (share < most * GridTeam::kThreads * Program::kItemsPerThread) {
        most = std::min(most, static_cast<std::size_t>(multiprocessors_));
      }
    }
    auto blocks = static_cast<unsigned>(std::clamp<std::size_t>(wanted, 1, most));
    const bool has_clusters = limits.has_clusters && parts == 1;
    if (has_clusters && blocks <= 2 * tuning::kClusterBlocks) {
      blocks = std::min(blocks, tuning::kClusterBlocks);
    }
    const bool is_cluster = has_clusters && blocks > 1 && blocks <= tuning::kClusterBlocks;
    if (parts == 1) return launch(program, blocks, is_cluster, target_, {});
    SharedDevices::instance().run(this, device_, stream_.get(), streams_, [&] {
      // The memory of the pool is allocated in the first stream, and a search needs a whole device.
      for (std::size_t part = 1; part < streams_.size(); ++part) {
        order_.order(streams_[0], streams_[part]);
      }
      for (std::uint32_t part = 0; part < parts; ++part) {
        TeamParts team = parts_;
        team.mine = part;
        Program mine = program;
        mine.data.part = part;
        try {
          const DeviceGuard other(devices_[part]);
          launch(mine, blocks, false, streams_[part], team);
        } catch (...) {
          release_parts(part);
          throw;
        }
      }
    });
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
    std::size_t most_blocks = 0;          ///< number of resident blocks; 0: not yet known
    std::size_t most_blocks_of_part = 0;  ///< likewise, of each of several parts
    bool has_clusters = false;
  };

  /// At least the static shared memory of the programs with the most dynamic shared memory.
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
    constexpr std::size_t kShared = shared_bytes<Program>();
    std::size_t least = std::numeric_limits<std::size_t>::max(), least_of_part = least;
    for (const int device : devices_) {
      const DeviceGuard guard(device);
      int most_shared = 0, resident = 0;
      JFPX_CUDA_TRY(
          cudaDeviceGetAttribute(&most_shared, cudaDevAttrMaxSharedMemoryPerBlockOptin, device));
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
      const std::size_t blocks = std::min<std::size_t>(static_cast<unsigned>(resident),
                                                       Program::kBlocksPerMultiprocessor) *
                                 static_cast<unsigned>(multiprocessors_);
      const auto times = static_cast<std::size_t>(std::ranges::count(devices_, device));
      if (device == device_) least = std::min(least, blocks);
      least_of_part = std::min(least_of_part, blocks / times);
    }
    limits.has_clusters = has_hopper_code();
    if (limits.has_clusters) {
      JFPX_CUDA_TRY(
          cudaFuncSetAttribute(kernel, cudaFuncAttributeNonPortableClusterSizeAllowed, 1));
    }
    limits.most_blocks_of_part = least_of_part;
    limits.most_blocks = least;
    return limits;
  }
  template <class Program>
  struct Limits : Launch {};

  /// By part: its first item, as a fraction of the items of a column.
  std::vector<double> first_items(const PageLayout& layout) const {
    std::vector<double> first(devices_.size());
    const device::Division* const division = divisions_.of(layout.index);
    for (std::size_t part = 0; part < first.size(); ++part) {
      first[part] = division == nullptr || !division->is_known()
                        ? static_cast<double>(part) / static_cast<double>(first.size())
                        : division->begin[part] / static_cast<double>(layout.items);
    }
    return first;
  }

  /// Gives a buffer other memory: of all devices for a large array, otherwise of the first one.
  /// @param used number of elements without slack
  template <class T>
  void replace(Buffer<T>* buffer, std::size_t capacity, std::size_t used, const char* what,
               PageLayout layout) {
    const DeviceGuard guard(device_);
    const bool is_shared = shares_memory_ && layout.index != ArrayIndex::of_first &&
                           capacity * sizeof(T) > (devices_.size() - 1) * MappedMemory::kPage;
    if (layout.items == 0) layout.items = used;
    layout.items = layout.items * capacity / used;
    GrowableArray<T, WorldMemory> array;
    array.reserve(capacity, [&](std::size_t bytes) {
      if (!is_shared) return WorldMemory(DeviceMemory(pool_, stream_.get(), bytes, what));
      return WorldMemory(std::make_unique<SharedArray>(&shared_arrays_, devices_, bytes, layout,
                                                       first_items(layout), what, stream_.get()));
    });
    buffer->array_.swap(array);
  }

  /// What the devices read and write most often, in a page of each part.
  struct PartMemory {
    DeviceBarrier barrier;
    alignas(128) device::PartState state;
  };
  static_assert(sizeof(PartMemory) <= MappedMemory::kPage);
  PartMemory* memory_of(std::uint32_t part) const noexcept {
    return reinterpret_cast<PartMemory*>(static_cast<std::byte*>(part_memory_.data()) +
                                         part * MappedMemory::kPage);
  }

  /// Creates what several devices need.
  void start_parts() {
    share(pool_, devices_);
    streams_.push_back(stream_.get());
    for (std::size_t part = 1; part < devices_.size(); ++part) {
      other_streams_.push_back(std::make_unique<OwnedStream>(devices_[part]));
      streams_.push_back(other_streams_.back()->get());
    }
    ended_.reserve(1, "barriers");
    *ended_.data() = 0;
    parts_.ended = ended_.data();
    std::vector<std::uint32_t> by_part(devices_.size());
    std::iota(by_part.begin(), by_part.end(), 0u);
    part_memory_ =
        MappedMemory(devices_, devices_.size() * MappedMemory::kPage, by_part, "barriers");
    parts_.count = parts();
    for (std::uint32_t part = 0; part < parts(); ++part) {
      parts_.barriers[part] = &memory_of(part)->barrier;
    }
    reset_barriers();
  }
  void reset_barriers() {
    const DeviceGuard guard(device_);
    for (std::size_t part = 0; part < devices_.size(); ++part) {
      JFPX_CUDA_TRY(
          cudaMemsetAsync(parts_.barriers[part], 0, sizeof(DeviceBarrier), stream_.get()));
    }
    JFPX_CUDA_TRY(cudaStreamSynchronize(stream_.get()));
  }
  /// Ends the launches of the first parts of a program that could not be launched for the others.
  /// They wait at their first barrier and have changed nothing.
  void release_parts(std::uint32_t launched) {
    if (launched == 0) return;
    // Earlier programs must not be ended.
    for (std::uint32_t part = launched; part < parts(); ++part) {
      static_cast<void>(cudaStreamSynchronize(streams_[part]));
    }
    std::atomic_ref(*ended_.data()).store(1);
    for (std::uint32_t part = 0; part < launched; ++part) {
      static_cast<void>(cudaStreamSynchronize(streams_[part]));
    }
    std::atomic_ref(*ended_.data()).store(0);
    static_cast<void>(cudaGetLastError());
    reset_barriers();
  }

  /// Launches a program on the current device.
  template <class Program>
  void launch(const Program& program, unsigned blocks, bool is_cluster, Stream stream,
              const TeamParts& parts) {
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
    config.stream = stream;
    config.attrs = &attribute;
    config.numAttrs = 1;
    std::uint32_t* scratch = scratch_.data();
    void* arguments[] = {const_cast<Program*>(&program), &scratch, &is_cluster,
                         const_cast<TeamParts*>(&parts)};
    JFPX_CUDA_TRY(cudaLaunchKernelExC(&config, program_kernel<Program>(), arguments));
  }

  template <class T>
  void transfer(T* to, const T* from, std::size_t count, cudaMemcpyKind kind) {
    if (count == 0) return;
    const DeviceGuard guard(device_);
    JFPX_CUDA_TRY(cudaMemcpyAsync(to, from, count * sizeof(T), kind, stream_.get()));
  }

  std::vector<int> devices_;  ///< by part
  int device_;                ///< the first one
  OwnedStream stream_;
  Stream target_ = stream_.get();  ///< of launches: `stream_`, or one that is being captured
  MemoryPool pool_;
  OwnedEvent marks_[device::kMarks];
  OrderingEvent order_;
  DeviceSearch search_;
  DeviceBuffer<std::uint32_t> scratch_;
  DeviceBuffer<device::PartState> state_;  ///< of one device
  PinnedBuffer<std::byte> staging_;
  int multiprocessors_ = 0;  ///< of each device
  // Of several devices.
  std::vector<std::unique_ptr<OwnedStream>> other_streams_;
  std::vector<Stream> streams_;  ///< by part
  bool shares_memory_ = false;   ///< whether all devices share memory that is reserved now
  device::Divisions divisions_;
  SharedArray::List shared_arrays_;
  MappedMemory part_memory_;
  PinnedBuffer<std::uint32_t> ended_;  ///< TeamParts::ended
  TeamParts parts_;
  std::tuple<Limits<device::ForceProgram>, Limits<device::BoundsProgram>,
             Limits<device::SphereProgram>, Limits<device::ShapeProgram>,
             Limits<device::MatchProgram>, Limits<device::PrepareProgram<device::kPrepareOneBlock>>,
             Limits<device::PrepareProgram<device::kPrepareBodies>>,
             Limits<device::PrepareProgram<device::kPlaceRows>>,
             Limits<device::PrepareProgram<device::kBuildInnerRows>>,
             Limits<device::PrepareProgram<device::kBuildRows>>,
             Limits<device::SolveProgram<soft_step::kContactRowKinds>>,
             Limits<device::SolveProgram<soft_step::kRowKinds>>,
             Limits<device::BlockSolveProgram<device::kSphereRowKinds>>,
             Limits<device::BlockSolveProgram<soft_step::kContactRowKinds>>,
             Limits<device::BlockSolveProgram<soft_step::kRowKinds>>, Limits<device::CommitProgram>,
             Limits<device::EditProgram>, Limits<device::MergeProgram>>
      limits_;
};

}  // namespace

std::unique_ptr<DeviceWorld> make_world(const Scene& scene, const std::vector<int>& devices) {
  return std::make_unique<device::DeviceStep<CudaDevice>>(scene,
                                                          std::make_unique<CudaDevice>(devices));
}

}  // namespace cuda
}  // namespace JFPX_ABI
}  // namespace jfpx
