/// The balls of a world on a CUDA device: a kernel writes the items that OpenGL draws.
#include <jfpx/cuda/world.hpp>

#include "src/base/cuda/cuda_try.hpp"
#include "src/viewer/cuda/shared_buffer.hpp"
#include "src/viewer/world_spheres.hpp"

#include <cuda_runtime.h>

namespace jfpx {
inline namespace JFPX_ABI {
namespace view {
namespace {

constexpr unsigned kThreads = 256;

__global__ void write_items(cuda::DeviceStates states, const Ball* balls, std::size_t count,
                            Vec3 eye, SphereItem* items) {
  const std::size_t k = blockIdx.x * std::size_t{kThreads} + threadIdx.x;
  if (k >= count) return;
  const Ball ball = balls[k];
  items[k] = make_sphere_item(states.positions[ball.body] - eye, static_cast<Real>(ball.radius),
                              states.orientations[ball.body], ball.paint);
}

class WorldSpheres final : public ResidentSpheres {
 public:
  WorldSpheres(World* world, const std::vector<Ball>& balls) : world_(world), count_(balls.size()) {
    const std::size_t bytes = count_ * sizeof(Ball);
    JFPX_CUDA_TRY_ALLOC(cudaMalloc(&balls_, bytes), bytes, "pictures");
    JFPX_CUDA_TRY(cudaMemcpy(balls_, balls.data(), bytes, cudaMemcpyHostToDevice));
    JFPX_CUDA_TRY(cudaStreamSynchronize(nullptr));  // the copy may end after cudaMemcpy() returns
  }
  ~WorldSpheres() override { cudaFree(balls_); }

  std::size_t count() const override { return count_; }

  std::unique_ptr<SharedBuffer> share(GLuint buffer) override {
    auto shared = std::make_unique<CudaSharedBuffer>(buffer, count_ * sizeof(SphereItem));
    host_copy_reason_ = shared->host_copy_reason();
    return shared;
  }

  void write(SharedBuffer* buffer, const Vec3& eye) override {
    const cuda::DeviceStates states = cuda::device_states(*world_);
    auto* items = static_cast<SphereItem*>(buffer->map(states.stream));
    const auto blocks = static_cast<unsigned>((count_ + kThreads - 1) / kThreads);
    write_items<<<blocks, kThreads, 0, states.stream>>>(states, balls_, count_, eye, items);
    JFPX_CUDA_TRY(cudaGetLastError());
    buffer->unmap(states.stream);
  }

  const std::string& host_copy_reason() const override { return host_copy_reason_; }

 private:
  World* world_;
  std::size_t count_;
  Ball* balls_ = nullptr;  ///< in device memory
  std::string host_copy_reason_;
};

}  // namespace

std::unique_ptr<ResidentSpheres> make_world_spheres(World* world, const std::vector<Ball>& balls) {
  return std::make_unique<WorldSpheres>(world, balls);
}

}  // namespace view
}  // namespace JFPX_ABI
}  // namespace jfpx
