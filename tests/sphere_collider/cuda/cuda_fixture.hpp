/// Fixtures of the tests of the CUDA backend.
#pragma once

#include <jfpx/cuda/sphere_collider.hpp>

#include "src/base/cuda/device_buffer.hpp"
#include "src/base/cuda/probe.hpp"
#include "tests/support/sphere_fixtures.hpp"

#include <gtest/gtest.h>

#include <cstdlib>

namespace jfpx {
inline namespace JFPX_ABI {
namespace test {

using namespace cuda;
using Spheres = std::vector<SphereInstance>;

/// Tests that need a device. Without one they are skipped, or fail if JFPX_REQUIRE_CUDA is set.
class Cuda : public testing::Test {
 protected:
  void SetUp() override {
    const BackendStatus status = probe();
    usable_ = status.usable;
    if (usable_) return;
    if (std::getenv("JFPX_REQUIRE_CUDA") != nullptr) FAIL() << status.reason;
    GTEST_SKIP() << status.reason;
  }
  void TearDown() override {
    inject_fault(-1, cudaSuccess);
    if (usable_) {
      EXPECT_EQ(cudaGetLastError(), cudaSuccess) << "a CUDA error was not cleared";
    }
  }

  static std::unique_ptr<SphereCollider> make(
      SphereAlgorithm algorithm = SphereAlgorithm::automatic) {
    return make_sphere_collider({.backend = Backend::cuda, .algorithm = algorithm});
  }
  static std::size_t free_bytes() {
    std::size_t free = 0, total = 0;
    JFPX_CUDA_TRY(cudaDeviceSynchronize());
    JFPX_CUDA_TRY(cudaMemGetInfo(&free, &total));
    return free;
  }

 private:
  bool usable_ = false;
};

/// Input and output of a search on a stream.
struct DeviceData {
  explicit DeviceData(const Spheres& input, std::size_t capacity) : stream(0), pool(0) {
    spheres.reserve(pool, stream.get(), input.size() + 1, "spheres");
    contacts.reserve(pool, stream.get(), capacity + 1, "contacts");
    count.reserve(1, "count");
    upload(input);
  }
  ~DeviceData() { static_cast<void>(cudaStreamSynchronize(stream.get())); }
  void upload(const Spheres& input) {
    JFPX_CUDA_TRY(cudaMemcpyAsync(spheres.data(), input.data(),
                                  input.size() * sizeof(SphereInstance), cudaMemcpyHostToDevice,
                                  stream.get()));
  }
  void wait() const { JFPX_CUDA_TRY(cudaStreamSynchronize(stream.get())); }
  template <typename T>
  std::vector<T> download(const T* from, std::size_t n) const {
    std::vector<T> to(n);
    JFPX_CUDA_TRY(
        cudaMemcpyAsync(to.data(), from, n * sizeof(T), cudaMemcpyDeviceToHost, stream.get()));
    wait();
    return to;
  }

  OwnedStream stream;
  MemoryPool pool;
  DeviceBuffer<SphereInstance> spheres;
  DeviceBuffer<SphereContact> contacts;
  PinnedBuffer<ContactCount> count;
};

/// Returns the results of DeviceSphereCollider::test_pairs() for the spheres of `data`.
inline std::vector<PairResult> test_pairs(const DeviceData& data,
                                          std::span<const SpherePair> pairs) {
  DeviceBuffer<SpherePair> d_pairs;
  DeviceBuffer<PairResult> results;
  d_pairs.reserve(data.pool, data.stream.get(), pairs.size() + 1, "pairs");
  results.reserve(data.pool, data.stream.get(), pairs.size() + 1, "results");
  JFPX_CUDA_TRY(cudaMemcpyAsync(d_pairs.data(), pairs.data(), pairs.size_bytes(),
                                cudaMemcpyHostToDevice, data.stream.get()));
  // In double precision a result has padding, which no kernel writes but the copy reads.
  JFPX_CUDA_TRY(cudaMemsetAsync(results.data(), 0, results.capacity() * sizeof(PairResult),
                                data.stream.get()));
  DeviceSphereCollider collider(data.stream.get());
  collider.test_pairs(data.spheres.data(), d_pairs.data(), pairs.size(), results.data());
  return data.download(results.data(), pairs.size());
}

}  // namespace test
}  // namespace JFPX_ABI
}  // namespace jfpx
