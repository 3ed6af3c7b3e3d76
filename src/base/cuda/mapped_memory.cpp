/// Memory whose pages are on several devices, by the virtual memory management of the driver.
#include "src/base/cuda/mapped_memory.hpp"

#include <jfpx/error.hpp>

#include <cuda.h>

#include <algorithm>
#include <string>

namespace jfpx {
inline namespace JFPX_ABI {
namespace cuda {
namespace {

/// A function of the driver. The library does not link the driver, which is absent on machines
/// without a GPU.
template <class Function>
Function* driver_function(const char* name) {
  void* function = nullptr;
  cudaDriverEntryPointQueryResult found = cudaDriverEntryPointSymbolNotFound;
#if CUDART_VERSION >= 12050
  JFPX_CUDA_TRY(
      cudaGetDriverEntryPointByVersion(name, &function, 12000, cudaEnableDefault, &found));
#else
  JFPX_CUDA_TRY(cudaGetDriverEntryPoint(name, &function, cudaEnableDefault, &found));
#endif
  if (found != cudaDriverEntryPointSuccess) {
    throw DeviceError(std::string("the CUDA driver has no function ") + name);
  }
  return reinterpret_cast<Function*>(function);
}

struct Driver {
  decltype(cuMemAddressReserve)* reserve =
      driver_function<decltype(cuMemAddressReserve)>("cuMemAddressReserve");
  decltype(cuMemAddressFree)* free =
      driver_function<decltype(cuMemAddressFree)>("cuMemAddressFree");
  decltype(cuMemCreate)* create = driver_function<decltype(cuMemCreate)>("cuMemCreate");
  decltype(cuMemRelease)* release = driver_function<decltype(cuMemRelease)>("cuMemRelease");
  decltype(cuMemMap)* map = driver_function<decltype(cuMemMap)>("cuMemMap");
  decltype(cuMemUnmap)* unmap = driver_function<decltype(cuMemUnmap)>("cuMemUnmap");
  decltype(cuMemSetAccess)* set_access =
      driver_function<decltype(cuMemSetAccess)>("cuMemSetAccess");
};
const Driver& driver() {
  static const Driver functions;
  return functions;
}

/// Values of errors of the driver and of the runtime are equal.
cudaError_t runtime_error(CUresult result) { return static_cast<cudaError_t>(result); }

std::vector<int> distinct(std::vector<int> devices) {
  std::ranges::sort(devices);
  devices.erase(std::unique(devices.begin(), devices.end()), devices.end());
  return devices;
}

CUmemAllocationProp memory_of(int device) {
  CUmemAllocationProp properties{};
  properties.type = CU_MEM_ALLOCATION_TYPE_PINNED;
  properties.location.type = CU_MEM_LOCATION_TYPE_DEVICE;
  properties.location.id = device;
  return properties;
}

}  // namespace

void share(const MemoryPool& pool, const std::vector<int>& devices) {
  std::vector<cudaMemAccessDesc> access;
  for (const int device : distinct(devices)) {
    cudaMemAccessDesc to{};
    to.location.type = cudaMemLocationTypeDevice;
    to.location.id = device;
    to.flags = cudaMemAccessFlagsProtReadWrite;
    access.push_back(to);
  }
  JFPX_CUDA_TRY(cudaMemPoolSetAccess(pool.get(), access.data(), access.size()));
}

MappedMemory::MappedMemory(const std::vector<int>& devices, std::size_t bytes,
                           const std::vector<std::uint32_t>& parts, const char* what)
    : bytes_(parts.size() * kPage), devices_(distinct(devices)) {
  const auto attempt = [&](CUresult result, const char* call) {
    if (result == CUDA_SUCCESS) return;
    release();
    throw_allocation_error(runtime_error(result), bytes, what, call, __FILE__, __LINE__);
  };
  // An injected fault of a test counts as that of the reservation.
  const cudaError_t injected = take_injected_fault();
  CUdeviceptr reserved = 0;
  attempt(injected != cudaSuccess ? static_cast<CUresult>(injected)
                                  : driver().reserve(&reserved, bytes_, 0, 0, 0),
          "cuMemAddressReserve");
  data_ = reinterpret_cast<void*>(reserved);
  for (std::size_t page = 0; page < parts.size();) {
    Piece piece{page * kPage, 0, devices[parts[page]], 0};
    while (page < parts.size() && devices[parts[page]] == piece.device) ++page;
    piece.end = page * kPage;
    const CUmemAllocationProp properties = memory_of(piece.device);
    attempt(driver().create(&piece.memory, piece.end - piece.begin, &properties, 0), "cuMemCreate");
    pieces_.push_back(piece);
  }
  attempt(map(), "cuMemMap");
}

MappedMemory::~MappedMemory() { release(); }

void MappedMemory::move(const std::vector<int>& devices, const std::vector<std::uint32_t>& parts,
                        const char* what, cudaStream_t stream) {
  const bool is_moved = std::ranges::any_of(pieces_, [&](const Piece& piece) {
    for (std::size_t page = piece.begin / kPage; page < piece.end / kPage; ++page) {
      if (devices[parts[page]] != piece.device) return true;
    }
    return false;
  });
  if (!is_moved) return;
  MappedMemory moved(devices, bytes_, parts, what);
  for (const int device : devices_) {
    const DeviceGuard guard(device);
    JFPX_CUDA_TRY(cudaDeviceSynchronize());  // programs may read the array on any device
  }
  JFPX_CUDA_TRY(cudaMemcpyAsync(moved.data_, data_, bytes_, cudaMemcpyDeviceToDevice, stream));
  JFPX_CUDA_TRY(cudaStreamSynchronize(stream));
  unmap();
  moved.unmap();
  pieces_.swap(moved.pieces_);
  const CUresult result = map();
  if (result == CUDA_SUCCESS) return;
  unmap();
  pieces_.swap(moved.pieces_);
  if (map() != CUDA_SUCCESS) {
    throw DeviceError(std::string("the memory for ") + what + " can no longer be accessed");
  }
  throw_allocation_error(runtime_error(result), bytes_, what, "cuMemMap", __FILE__, __LINE__);
}

CUresult MappedMemory::map() {
  for (const Piece& piece : pieces_) {
    const CUresult result =
        driver().map(address() + piece.begin, piece.end - piece.begin, 0, piece.memory, 0);
    if (result != CUDA_SUCCESS) return result;
    mapped_ = piece.end;
  }
  std::vector<CUmemAccessDesc> access;
  for (const int device : devices_) {
    access.push_back({memory_of(device).location, CU_MEM_ACCESS_FLAGS_PROT_READWRITE});
  }
  return driver().set_access(address(), bytes_, access.data(), access.size());
}

void MappedMemory::unmap() noexcept {
  if (mapped_ > 0) static_cast<void>(driver().unmap(address(), mapped_));
  mapped_ = 0;
}

void MappedMemory::release() noexcept {
  if (data_ == nullptr) return;
  unmap();
  for (const Piece& piece : pieces_) static_cast<void>(driver().release(piece.memory));
  static_cast<void>(driver().free(address(), bytes_));
  pieces_.clear();
  data_ = nullptr;
  bytes_ = 0;
}

}  // namespace cuda
}  // namespace JFPX_ABI
}  // namespace jfpx
