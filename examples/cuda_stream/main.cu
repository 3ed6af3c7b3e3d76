/// Finds contacts inside a CUDA program. Spheres are created on the device, kernels use the
/// contacts there, and one graph replays "collide, push apart" without the host.
#include <jfpx/cuda/sphere_collider.hpp>
#include <jfpx/error.hpp>

#include <cuda_runtime.h>

#include <cstdio>
#include <cstdlib>

namespace {

using jfpx::Real;

constexpr std::uint32_t kSpheres = 20000, kMaxContacts = 8 * kSpheres;
constexpr int kSteps = 200;

void check(cudaError_t error) {
  if (error == cudaSuccess) return;
  std::fprintf(stderr, "cuda_stream: %s\n", cudaGetErrorString(error));
  std::exit(1);
}

__device__ Real hash(std::uint32_t x) {
  x = (x ^ (x >> 16)) * 0x7feb352du;
  x = (x ^ (x >> 15)) * 0x846ca68bu;
  return static_cast<Real>((x ^ (x >> 16)) >> 8) / Real(1 << 24);
}

/// Spheres of radius 1/2 in a cube, at a volume fraction of about one half.
__global__ void make_spheres(jfpx::SphereInstance* spheres) {
  const std::uint32_t i = blockIdx.x * blockDim.x + threadIdx.x;
  if (i >= kSpheres) return;
  const Real side = 27;
  spheres[i] = {{side * hash(3 * i), side * hash(3 * i + 1), side * hash(3 * i + 2)}, Real(0.5)};
}

/// One thread per sphere. The contacts (a, b) of a sphere a are consecutive; each pushes a away.
__global__ void push_apart(jfpx::SphereInstance* spheres, const jfpx::SphereContact* contacts,
                           const jfpx::cuda::ContactCount* count) {
  const std::uint32_t a = blockIdx.x * blockDim.x + threadIdx.x;
  if (a >= kSpheres || count->complete == 0) return;
  std::uint64_t low = 0, high = count->contacts;  // the first contact of a
  while (low < high) {
    const std::uint64_t middle = (low + high) / 2;
    if (contacts[middle].a < a) {
      low = middle + 1;
    } else {
      high = middle;
    }
  }
  for (; low < count->contacts && contacts[low].a == a; ++low) {
    spheres[a].centre += contacts[low].normal * (contacts[low].distance * Real(-0.25));
  }
}

void run() {
  cudaStream_t stream = nullptr;
  check(cudaStreamCreateWithFlags(&stream, cudaStreamNonBlocking));
  jfpx::SphereInstance* spheres = nullptr;
  jfpx::SphereContact* contacts = nullptr;
  jfpx::cuda::ContactCount* count = nullptr;
  check(cudaMalloc(&spheres, kSpheres * sizeof *spheres));
  check(cudaMalloc(&contacts, kMaxContacts * sizeof *contacts));
  check(cudaMalloc(&count, sizeof *count));
  make_spheres<<<(kSpheres + 255) / 256, 256, 0, stream>>>(spheres);
  check(cudaGetLastError());

  {
    jfpx::cuda::DeviceSphereCollider collider(stream);
    collider.reserve(kSpheres, kMaxContacts);
    cudaGraph_t graph = nullptr;
    cudaGraphExec_t step = nullptr;
    check(cudaStreamBeginCapture(stream, cudaStreamCaptureModeGlobal));
    collider.find_contacts(spheres, kSpheres, contacts, kMaxContacts, count);
    push_apart<<<(kSpheres + 255) / 256, 256, 0, stream>>>(spheres, contacts, count);
    check(cudaGetLastError());
    check(cudaStreamEndCapture(stream, &graph));
    check(cudaGraphInstantiate(&step, graph, 0));

    for (int i = 0; i <= kSteps; ++i) {
      check(cudaGraphLaunch(step, stream));
      if (i % 50 != 0) continue;
      jfpx::cuda::ContactCount found;
      check(cudaMemcpyAsync(&found, count, sizeof found, cudaMemcpyDeviceToHost, stream));
      check(cudaStreamSynchronize(stream));
      std::printf("step %3d: %llu contacts\n", i, static_cast<unsigned long long>(found.contacts));
    }
    check(cudaGraphExecDestroy(step));
    check(cudaGraphDestroy(graph));
  }
  check(cudaFree(count));
  check(cudaFree(contacts));
  check(cudaFree(spheres));
  check(cudaStreamDestroy(stream));
}

}  // namespace

int main() {
  try {
    run();
  } catch (const jfpx::BackendUnavailable& e) {
    std::fprintf(stderr, "cuda_stream: %s\n", e.what());
    return 3;
  } catch (const jfpx::Error& e) {
    std::fprintf(stderr, "cuda_stream: %s\n", e.what());
    return 1;
  }
}
