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
                           const PageLayout& layout, const char* what) {
  bytes_ = (bytes + kPage - 1) / kPage * kPage;
  const auto attempt = [&](CUresult result, const char* call) {
    if (result == CUDA_SUCCESS) return;
    release();
    throw_allocation_error(runtime_error(result), bytes, what, call, __FILE__, __LINE__);
  };
  // An injected fault of a test counts as that of the reservation.
  const cudaError_t injected = take_injected_fault();
  CUdeviceptr address = 0;
  attempt(injected != cudaSuccess ? static_cast<CUresult>(injected)
                                  : driver().reserve(&address, bytes_, 0, 0, 0),
          "cuMemAddressReserve");
  data_ = reinterpret_cast<void*>(address);
  const auto device_of = [&](std::size_t page) {
    const std::size_t middle = std::min(page + kPage / 2, bytes - 1);
    return devices[layout.part_of(middle, bytes, devices.size())];
  };
  while (mapped_ < bytes_) {
    const int device = device_of(mapped_);
    std::size_t end = mapped_ + kPage;
    while (end < bytes_ && device_of(end) == device) end += kPage;
    const CUmemAllocationProp properties = memory_of(device);
    CUmemGenericAllocationHandle memory = 0;
    attempt(driver().create(&memory, end - mapped_, &properties, 0), "cuMemCreate");
    const CUresult result = driver().map(address + mapped_, end - mapped_, 0, memory, 0);
    driver().release(memory);  // the mapping keeps the memory
    attempt(result, "cuMemMap");
    mapped_ = end;
  }
  std::vector<CUmemAccessDesc> access;
  for (const int device : distinct(devices)) {
    access.push_back({memory_of(device).location, CU_MEM_ACCESS_FLAGS_PROT_READWRITE});
  }
  attempt(driver().set_access(address, bytes_, access.data(), access.size()), "cuMemSetAccess");
}

MappedMemory::~MappedMemory() { release(); }

void MappedMemory::release() noexcept {
  if (data_ == nullptr) return;
  const auto address = reinterpret_cast<CUdeviceptr>(data_);
  if (mapped_ > 0) static_cast<void>(driver().unmap(address, mapped_));
  static_cast<void>(driver().free(address, bytes_));
  data_ = nullptr;
  mapped_ = bytes_ = 0;
}

}  // namespace cuda
}  // namespace JFPX_ABI
}  // namespace jfpx
