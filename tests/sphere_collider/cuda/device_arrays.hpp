/// Arrays in device memory, and the results of ArrayCollider in host memory.
#pragma once

#include <jfpx/cuda/array_collider.hpp>

#include "tests/sphere_collider/cuda/cuda_fixture.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace test {

/// An array in device memory.
template <class T>
class DeviceArray {
 public:
  explicit DeviceArray(std::size_t n) : size_(n) {
    void* data = nullptr;
    JFPX_CUDA_TRY(cudaMalloc(&data, (n + 1) * sizeof(T)));
    data_ = static_cast<T*>(data);
    JFPX_CUDA_TRY(cudaMemset(data, 0xff, (n + 1) * sizeof(T)));
    JFPX_CUDA_TRY(cudaDeviceSynchronize());  // streams of the tests do not wait for the default one
  }
  explicit DeviceArray(const std::vector<T>& from) : DeviceArray(from.size()) {
    JFPX_CUDA_TRY(cudaMemcpy(data_, from.data(), size_ * sizeof(T), cudaMemcpyHostToDevice));
    JFPX_CUDA_TRY(cudaDeviceSynchronize());  // the memory of a vector is copied in the background
  }
  ~DeviceArray() { static_cast<void>(cudaFree(data_)); }
  DeviceArray(const DeviceArray&) = delete;
  DeviceArray& operator=(const DeviceArray&) = delete;
  T* data() const { return data_; }
  std::vector<T> download() const {
    std::vector<T> to(size_);
    JFPX_CUDA_TRY(cudaDeviceSynchronize());
    JFPX_CUDA_TRY(cudaMemcpy(to.data(), data_, size_ * sizeof(T), cudaMemcpyDeviceToHost));
    return to;
  }

 private:
  T* data_ = nullptr;
  std::size_t size_;
};

/// Spheres as arrays with five values between two positions and two between two radii.
class DeviceSpheres {
 public:
  explicit DeviceSpheres(const Spheres& from)
      : positions_(positions_of(from)), radii_(radii_of(from)), count_(from.size()) {}
  SphereArrays arrays() const {
    return {.count = count_,
            .positions = positions_.data(),
            .row_stride = 5,
            .radii = radii_.data(),
            .radius_stride = 2};
  }

 private:
  static std::vector<Real> positions_of(const Spheres& from) {
    std::vector<Real> to(5 * from.size());
    for (std::size_t i = 0; i < from.size(); ++i) {
      for (int k = 0; k < 3; ++k) to[5 * i + static_cast<std::size_t>(k)] = from[i].centre[k];
    }
    return to;
  }
  static std::vector<Real> radii_of(const Spheres& from) {
    std::vector<Real> to(2 * from.size());
    for (std::size_t i = 0; i < from.size(); ++i) to[2 * i] = from[i].radius;
    return to;
  }

  DeviceArray<Real> positions_, radii_;
  std::size_t count_;
};

/// The result of the last search, of `n` contacts, from its four arrays.
template <class Index>
std::vector<SphereContact> contacts_of(ArrayCollider& collider, std::size_t n, Stream stream) {
  const DeviceArray<Index> a(n), b(n);
  const DeviceArray<Real> normals(3 * n), distances(n);
  collider.write_pairs(a.data(), b.data(), n, stream);
  collider.write_contacts(normals.data(), distances.data(), n, stream);
  const auto ha = a.download(), hb = b.download();
  const auto hn = normals.download(), hd = distances.download();
  std::vector<SphereContact> contacts(n);
  for (std::size_t i = 0; i < n; ++i) {
    contacts[i] = {.a = static_cast<SphereIndex>(ha[i]),
                   .b = static_cast<SphereIndex>(hb[i]),
                   .normal = {hn[3 * i], hn[3 * i + 1], hn[3 * i + 2]},
                   .distance = hd[i]};
  }
  return contacts;
}

inline std::vector<SpherePair> pairs_of(ArrayCollider& collider, std::size_t n, Stream stream) {
  const DeviceArray<std::int64_t> a(n), b(n);
  collider.write_pairs(a.data(), b.data(), n, stream);
  const auto ha = a.download(), hb = b.download();
  std::vector<SpherePair> pairs(n);
  for (std::size_t i = 0; i < n; ++i) {
    pairs[i] = {static_cast<SphereIndex>(ha[i]), static_cast<SphereIndex>(hb[i])};
  }
  return pairs;
}

inline std::vector<SpherePair> pairs_of(ContactSpan contacts) {
  std::vector<SpherePair> pairs;
  for (const SphereContact& c : contacts) pairs.push_back({c.a, c.b});
  return pairs;
}

}  // namespace test
}  // namespace JFPX_ABI
}  // namespace jfpx
