/// Balls that fall into a box, on the GPU alone.
#include "examples/cuda_view/crowd.hpp"
#include "src/base/cuda/cuda_try.hpp"
#include "src/viewer/colours.hpp"

#include <cuda_runtime.h>

#include <cmath>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace cuda_view {
namespace {

constexpr Real kGravity = Real(9.81), kKept = Real(0.999), kEagerness = Real(0.3);
constexpr Real kWhole = 4294967296;  // pushes are counted in 2^-32 m
constexpr unsigned kThreads = 256;

unsigned blocks_for(std::uint64_t n) {
  return static_cast<unsigned>((n + kThreads - 1) / kThreads);
}

/// Memory of the device.
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

struct Push {
  unsigned long long x, y, z;  // two's complement
};

__global__ void move(std::uint32_t n, SphereInstance* balls, Vec3* velocity, Vec3* before,
                     Push* push) {
  const std::uint32_t i = blockIdx.x * kThreads + threadIdx.x;
  if (i >= n) return;
  velocity[i].y -= kGravity * Crowd::kStep;
  before[i] = balls[i].centre;
  balls[i].centre += velocity[i] * Crowd::kStep;
  push[i] = {0, 0, 0};
}

__device__ void add(unsigned long long* sum, Real metres) {
  atomicAdd(sum, static_cast<unsigned long long>(static_cast<long long>(metres * kWhole)));
}

__global__ void push_apart(const SphereContact* contacts, const cuda::ContactCount* count,
                           Push* push) {
  const std::uint64_t stride = std::uint64_t{gridDim.x} * kThreads;
  for (std::uint64_t k = blockIdx.x * kThreads + threadIdx.x; k < count->contacts; k += stride) {
    const SphereContact& c = contacts[k];
    const Vec3 way = c.normal * (-c.distance * kEagerness);
    add(&push[c.a].x, way.x), add(&push[c.a].y, way.y), add(&push[c.a].z, way.z);
    add(&push[c.b].x, -way.x), add(&push[c.b].y, -way.y), add(&push[c.b].z, -way.z);
  }
}

__device__ Real metres(unsigned long long sum) {
  return static_cast<Real>(static_cast<long long>(sum)) / kWhole;
}
__device__ Real clamped(Real x, Real most) { return x < -most ? -most : x > most ? most : x; }

__global__ void settle(std::uint32_t n, Real half_side, SphereInstance* balls, Vec3* velocity,
                       const Vec3* before, const Push* push) {
  const std::uint32_t i = blockIdx.x * kThreads + threadIdx.x;
  if (i >= n) return;
  Vec3 p = balls[i].centre + Vec3{metres(push[i].x), metres(push[i].y), metres(push[i].z)};
  p = {clamped(p.x, half_side), p.y < Crowd::kRadius ? Crowd::kRadius : p.y,
       clamped(p.z, half_side)};
  velocity[i] = (p - before[i]) * (kKept / Crowd::kStep);
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

/// A stream, and what is pinned for the host to read.
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

/// A loose tower over the middle of the box, each layer a little aside of the one below.
std::vector<SphereInstance> tower(std::uint32_t n, Real side) {
  const Real spacing = Real(2.2) * Crowd::kRadius;
  const auto row = static_cast<std::uint32_t>(std::fmax(side * Real(0.6) / spacing, Real(1)));
  std::vector<SphereInstance> balls;
  for (std::uint32_t i = 0; i < n; ++i) {
    const std::uint32_t layer = i / (row * row);
    const Real aside = Real(0.31) * static_cast<Real>(layer % 3);
    const auto place = [&](std::uint32_t k) {
      return (static_cast<Real>(k) - static_cast<Real>(row - 1) / 2) * spacing + aside;
    };
    balls.push_back({{place(i % row), 4 + static_cast<Real>(layer) * spacing, place(i / row % row)},
                     Crowd::kRadius});
  }
  return balls;
}

}  // namespace

struct Crowd::Impl {
  std::uint32_t n;
  Real side;
  Queue queue;
  cuda::DeviceSphereCollider collider;
  Array<SphereInstance> balls;
  Array<Vec3> velocity, before;
  Array<Push> push;
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
        push(count),
        paints(count) {
    reserve(std::size_t{6} * n);
    const std::vector<SphereInstance> start = tower(n, side);
    std::vector<view::Paint> colours;
    for (std::uint32_t i = 0; i < n; ++i) colours.push_back(view::ball_paint(i));
    JFPX_CUDA_TRY(
        cudaMemcpy(balls.get(), start.data(), n * sizeof start[0], cudaMemcpyHostToDevice));
    JFPX_CUDA_TRY(
        cudaMemcpy(paints.get(), colours.data(), n * sizeof colours[0], cudaMemcpyHostToDevice));
    JFPX_CUDA_TRY(cudaMemset(velocity.get(), 0, n * sizeof(Vec3)));
  }

  void reserve(std::size_t more) {
    capacity = more;
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

Crowd::Crowd(std::uint32_t balls) : impl_(std::make_unique<Impl>(balls)) {}
Crowd::~Crowd() = default;

void Crowd::step() {
  Impl& m = *impl_;
  const unsigned blocks = blocks_for(m.n);
  move<<<blocks, kThreads, 0, m.queue.stream>>>(m.n, m.balls.get(), m.velocity.get(),
                                                m.before.get(), m.push.get());
  JFPX_CUDA_TRY(cudaGetLastError());
  m.find_contacts();
  push_apart<<<4 * blocks, kThreads, 0, m.queue.stream>>>(m.contacts->get(), m.queue.count,
                                                          m.push.get());
  JFPX_CUDA_TRY(cudaGetLastError());
  settle<<<blocks, kThreads, 0, m.queue.stream>>>(m.n, m.side / 2 - kRadius, m.balls.get(),
                                                  m.velocity.get(), m.before.get(), m.push.get());
  JFPX_CUDA_TRY(cudaGetLastError());
}

void Crowd::write_items(view::SphereItem* items, const Vec3& eye) {
  Impl& m = *impl_;
  write<<<blocks_for(m.n), kThreads, 0, m.queue.stream>>>(m.n, m.balls.get(), m.paints.get(), eye,
                                                          items);
  JFPX_CUDA_TRY(cudaGetLastError());
}

cuda::Stream Crowd::stream() const { return impl_->queue.stream; }
std::uint32_t Crowd::size() const { return impl_->n; }
std::uint64_t Crowd::contacts() const { return impl_->queue.count->contacts; }
Real Crowd::side() const { return impl_->side; }

}  // namespace cuda_view
}  // namespace JFPX_ABI
}  // namespace jfpx
