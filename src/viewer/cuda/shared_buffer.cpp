/// An OpenGL buffer that CUDA writes.
#include "src/viewer/cuda/shared_buffer.hpp"

#include "src/base/cuda/cuda_try.hpp"

#include <epoxy/gl.h>
// After epoxy, which replaces the OpenGL header that this header would include.
#include <cuda_gl_interop.h>

namespace jfpx {
inline namespace JFPX_ABI {
namespace view {
namespace {

/// Reason why CUDA can't access the device of OpenGL; empty if it can.
std::string find_obstacle() {
  unsigned count = 0;
  int used = 0, shared = 0;
  const cudaError_t error = cudaGLGetDevices(&count, &shared, 1, cudaGLDeviceListAll);
  if (error != cudaSuccess) {
    static_cast<void>(cudaGetLastError());
    return std::string("OpenGL draws without a CUDA device (") + cudaGetErrorName(error) + ")";
  }
  JFPX_CUDA_TRY(cudaGetDevice(&used));
  return count == 0 || shared != used ? "OpenGL draws with another device" : "";
}

}  // namespace

struct CudaSharedBuffer::Impl {
  GLuint buffer;
  std::size_t bytes;
  cudaGraphicsResource_t resource = nullptr;
  void *device = nullptr, *host = nullptr;  // for copies through the host

  Impl(GLuint name, std::size_t size) : buffer(name), bytes(size) {}
  ~Impl() {
    if (resource != nullptr) cudaGraphicsUnregisterResource(resource);
    cudaFree(device);
    cudaFreeHost(host);
  }
};

CudaSharedBuffer::CudaSharedBuffer(GLuint buffer, std::size_t bytes)
    : impl_(std::make_unique<Impl>(buffer, bytes)), host_copy_reason_(find_obstacle()) {
  if (host_copy_reason_.empty()) {
    JFPX_CUDA_TRY(cudaGraphicsGLRegisterBuffer(&impl_->resource, buffer,
                                               cudaGraphicsRegisterFlagsWriteDiscard));
    return;
  }
  JFPX_CUDA_TRY_ALLOC(cudaMalloc(&impl_->device, bytes), bytes, "pictures");
  JFPX_CUDA_TRY_ALLOC(cudaMallocHost(&impl_->host, bytes), bytes, "pictures");
}
CudaSharedBuffer::~CudaSharedBuffer() = default;

void* CudaSharedBuffer::map(cuda::Stream stream) {
  if (impl_->resource == nullptr) return impl_->device;
  void* memory = nullptr;
  std::size_t size = 0;
  JFPX_CUDA_TRY(cudaGraphicsMapResources(1, &impl_->resource, stream));
  JFPX_CUDA_TRY(cudaGraphicsResourceGetMappedPointer(&memory, &size, impl_->resource));
  return memory;
}

void CudaSharedBuffer::unmap(cuda::Stream stream) {
  if (impl_->resource != nullptr) {
    JFPX_CUDA_TRY(cudaGraphicsUnmapResources(1, &impl_->resource, stream));
    return;
  }
  JFPX_CUDA_TRY(
      cudaMemcpyAsync(impl_->host, impl_->device, impl_->bytes, cudaMemcpyDeviceToHost, stream));
  JFPX_CUDA_TRY(cudaStreamSynchronize(stream));
  glBindBuffer(GL_ARRAY_BUFFER, impl_->buffer);
  glBufferSubData(GL_ARRAY_BUFFER, 0, static_cast<GLsizeiptr>(impl_->bytes), impl_->host);
}

}  // namespace view
}  // namespace JFPX_ABI
}  // namespace jfpx
