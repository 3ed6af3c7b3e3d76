/// Simulation of balls that fall into a box, entirely on the GPU.
#include "examples/cuda_view/simulation.hpp"
#include "src/base/cuda/cuda_try.hpp"
#include "src/viewer/colours.hpp"

#include <cuda_runtime.h>

#include <cmath>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace cuda_view {
namespace {

constexpr Real kGravity = Real(9.81), kDamping = Real(0.999), kRelaxation = Real(0.3);
constexpr Real kWhole = 4294967296;  // displacements are stored in units of 2^-32 m
constexpr unsigned kThreads = 256;

unsigned blocks_for(std::uint64_t n) {
  return static_cast<unsigned>((n + kThreads - 1) / kThreads);
}

/// Device memory.
template <class T>
class Array {
 public:
  explicit Array(std::size_t n) {
    JFPX_CUDA_TRY_ALLOC(cudaMalloc(&data_, n * sizeof(T)), n * sizeof(T), "balls");
  }
  ~Array() { cudaFree(data_); }
  Array(const Array&) = delete;
  Array& operator=(const Array&) = delete;
  T* get() const { return data_; }

 private:
  T* data_ = nullptr;
};

struct Displacement {
  unsigned long long x, y, z;  // two's complement
};

__global__ void predict(std::uint32_t n, SphereInstance* balls, Vec3* velocity, Vec3* before,
                        Displacement* displacement) {
  const std::uint32_t i = blockIdx.x * kThreads + threadIdx.x;
  if (i >= n) return;
  velocity[i].y -= kGravity * Simulation::kStep;
  before[i] = balls[i].centre;
  balls[i].centre += velocity[i] * Simulation::kStep;
  displacement[i] = {0, 0, 0};
}

__device__ void add(unsigned long long* sum, Real metres) {
  atomicAdd(sum, static_cast<unsigned long long>(static_cast<long long>(metres * kWhole)));
}

__global__ void separate(const SphereContact* contacts, const cuda::ContactCount* count,
                         Displacement* displacement) {
  const std::uint64_t stride = std::uint64_t{gridDim.x} * kThreads;
  for (std::uint64_t k = blockIdx.x * kThreads + threadIdx.x; k < count->contacts; k += stride) {
    const SphereContact& c = contacts[k];
    const Vec3 way = c.normal * (-c.distance * kRelaxation);
    add(&displacement[c.a].x, way.x), add(&displacement[c.a].y, way.y),
        add(&displacement[c.a].z, way.z);
    add(&displacement[c.b].x, -way.x), add(&displacement[c.b].y, -way.y),
        add(&displacement[c.b].z, -way.z);
  }
}

__device__ Real metres(unsigned long long sum) {
  return static_cast<Real>(static_cast<long long>(sum)) / kWhole;
}
__device__ Real clamped(Real x, Real max) { return x < -max ? -max : x > max ? max : x; }

__global__ void update_velocities(std::uint32_t n, Real half_side, SphereInstance* balls,
                                  Vec3* velocity, const Vec3* before,
                                  const Displacement* displacement) {
  const std::uint32_t i = blockIdx.x * kThreads + threadIdx.x;
  if (i >= n) return;
  Vec3 p = balls[i].centre +
           Vec3{metres(displacement[i].x), metres(displacement[i].y), metres(displacement[i].z)};
  p = {clamped(p.x, half_side), p.y < Simulation::kRadius ? Simulation::kRadius : p.y,
       clamped(p.z, half_side)};
  velocity[i] = (p - before[i]) * (kDamping / Simulation::kStep);
  balls[i].centre = p;
}

__global__ void write(std::uint32_t n, const SphereInstance* balls, const view::Paint* paints,
                      Vec3 eye, view::SphereItem* items) {
  const std::uint32_t i = blockIdx.x * kThreads + threadIdx.x;
  if (i >= n) return;
  const Vec3 p = balls[i].centre - eye;
  view::SphereItem item{};
  item.centre[0] = static_cast<float>(p.x);
  item.centre[1] = static_cast<float>(p.y);
  item.centre[2] = static_cast<float>(p.z);
  item.radius = static_cast<float>(balls[i].radius);
  item.turn[3] = 1;
  item.paint = paints[i];
  items[i] = item;
}

/// A stream, and pinned memory for the host.
struct Queue {
  cudaStream_t stream = nullptr;
  cuda::ContactCount* count = nullptr;
  Queue() {
    JFPX_CUDA_TRY(cudaStreamCreateWithFlags(&stream, cudaStreamNonBlocking));
    JFPX_CUDA_TRY(cudaMallocHost(&count, sizeof *count));
    *count = {};
  }
  ~Queue() {
    cudaFreeHost(count);
    cudaStreamDestroy(stream);
  }
};

/// A loose stack of layers above the middle of the box, each layer offset from the one below.
std::vector<SphereInstance> initial_balls(std::uint32_t n, Real side) {
  const Real spacing = Real(2.2) * Simulation::kRadius;
  const auto row = static_cast<std::uint32_t>(std::fmax(side * Real(0.6) / spacing, Real(1)));
  std::vector<SphereInstance> balls;
  for (std::uint32_t i = 0; i < n; ++i) {
    const std::uint32_t layer = i / (row * row);
    const Real aside = Real(0.31) * static_cast<Real>(layer % 3);
    const auto position = [&](std::uint32_t k) {
      return (static_cast<Real>(k) - static_cast<Real>(row - 1) / 2) * spacing + aside;
    };
    balls.push_back(
        {{position(i % row), 4 + static_cast<Real>(layer) * spacing, position(i / row % row)},
         Simulation::kRadius});
  }
  return balls;
}

}  // namespace

struct Simulation::Impl {
  std::uint32_t n;
  Real side;
  Queue queue;
  cuda::DeviceSphereCollider collider;
  Array<SphereInstance> balls;
  Array<Vec3> velocity, before;
  Array<Displacement> displacement;
  Array<view::Paint> paints;
  std::size_t capacity;
  std::unique_ptr<Array<SphereContact>> contacts;

  explicit Impl(std::uint32_t count)
      : n(count),
        side(2 * std::cbrt(static_cast<Real>(count))),
        collider(queue.stream),
        balls(count),
        velocity(count),
        before(count),
        displacement(count),
        paints(count) {
    reserve(std::size_t{6} * n);
    const std::vector<SphereInstance> start = initial_balls(n, side);
    std::vector<view::Paint> colours;
    for (std::uint32_t i = 0; i < n; ++i) colours.push_back(view::ball_paint(i));
    JFPX_CUDA_TRY(
        cudaMemcpy(balls.get(), start.data(), n * sizeof start[0], cudaMemcpyHostToDevice));
    JFPX_CUDA_TRY(
        cudaMemcpy(paints.get(), colours.data(), n * sizeof colours[0], cudaMemcpyHostToDevice));
    JFPX_CUDA_TRY(cudaMemset(velocity.get(), 0, n * sizeof(Vec3)));
  }

  void reserve(std::size_t count) {
    capacity = count;
    contacts.reset();
    contacts = std::make_unique<Array<SphereContact>>(capacity);
    collider.reserve(n, capacity);
  }

  void find_contacts() {
    while (true) {
      collider.find_contacts(balls.get(), n, contacts->get(), capacity, queue.count);
      JFPX_CUDA_TRY(cudaStreamSynchronize(queue.stream));
      if (queue.count->complete != 0) return;
      reserve(static_cast<std::size_t>(queue.count->contacts) * 5 / 4);
    }
  }
};

Simulation::Simulation(std::uint32_t balls) : impl_(std::make_unique<Impl>(balls)) {}
Simulation::~Simulation() = default;

void Simulation::step() {
  Impl& m = *impl_;
  const unsigned blocks = blocks_for(m.n);
  predict<<<blocks, kThreads, 0, m.queue.stream>>>(m.n, m.balls.get(), m.velocity.get(),
                                                   m.before.get(), m.displacement.get());
  JFPX_CUDA_TRY(cudaGetLastError());
  m.find_contacts();
  separate<<<4 * blocks, kThreads, 0, m.queue.stream>>>(m.contacts->get(), m.queue.count,
                                                        m.displacement.get());
  JFPX_CUDA_TRY(cudaGetLastError());
  update_velocities<<<blocks, kThreads, 0, m.queue.stream>>>(m.n, m.side / 2 - kRadius,
                                                             m.balls.get(), m.velocity.get(),
                                                             m.before.get(), m.displacement.get());
  JFPX_CUDA_TRY(cudaGetLastError());
}

void Simulation::write_items(view::SphereItem* items, const Vec3& eye) {
  Impl& m = *impl_;
  write<<<blocks_for(m.n), kThreads, 0, m.queue.stream>>>(m.n, m.balls.get(), m.paints.get(), eye,
                                                          items);
  JFPX_CUDA_TRY(cudaGetLastError());
}

cuda::Stream Simulation::stream() const { return impl_->queue.stream; }
std::uint32_t Simulation::size() const { return impl_->n; }
std::uint64_t Simulation::contacts() const { return impl_->queue.count->contacts; }
Real Simulation::side() const { return impl_->side; }

}  // namespace cuda_view
}  // namespace JFPX_ABI
}  // namespace jfpx
