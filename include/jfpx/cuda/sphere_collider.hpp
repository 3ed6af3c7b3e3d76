/// Sphere collider on a CUDA stream: device pointers in, contacts in device memory out.
#pragma once

#include <jfpx/sphere_collider.hpp>

#include <cstddef>
#include <memory>

struct CUstream_st;

namespace jfpx {
inline namespace JFPX_ABI {
namespace cuda {

/// Equals cudaStream_t, without the CUDA headers.
using Stream = CUstream_st*;

/// ContactCount::first_invalid if all spheres are valid.
inline constexpr std::uint32_t kNoSphere = 0xffffffffu;

/// Result of a search, in memory that the device can write: device or mapped host memory.
struct ContactCount {
  /// Number of touching pairs; exact even if the result is not complete; 0 if a sphere is invalid.
  std::uint64_t contacts = 0;
  std::uint32_t first_invalid = kNoSphere;  ///< lowest index of an invalid sphere
  std::uint32_t complete = 0;               ///< 1: all contacts were written, 0: none were
};

/// Finds contacts on the device, in the order of one stream. Only the constructor, reserve() and
/// the destructor allocate or wait, so that all other calls can be captured in a CUDA graph. A
/// captured graph is valid until reserve() grows a buffer or the object is destroyed. Not
/// thread-safe. Objects are independent of each other, also on the same device.
class JFPX_API DeviceSphereCollider {
 public:
  /// Uses `device`, and enqueues all work on `stream`, which must belong to that device, outlive
  /// the object and not be capturing.
  /// @throws BackendUnavailable with the reason if the device can't be used, DeviceError
  explicit DeviceSphereCollider(Stream stream, int device = 0,
                                SphereAlgorithm algorithm = SphereAlgorithm::automatic);
  ~DeviceSphereCollider();
  DeviceSphereCollider(DeviceSphereCollider&&) noexcept;
  DeviceSphereCollider& operator=(DeviceSphereCollider&&) noexcept;

  /// Reserves memory for searches with up to `spheres` spheres and `contacts` contacts. Capacities
  /// never shrink.
  /// @throws InvalidArgument for more than 2^31 spheres, OutOfMemory with the number of bytes,
  /// DeviceError; earlier reservations then remain.
  void reserve(std::size_t spheres, std::size_t contacts);

  /// Enqueues the search for all touching pairs among `n` spheres. On completion *d_count is set
  /// and, if it is complete, d_contacts[0 .. contacts) holds the contacts sorted by (a, b). The
  /// result is complete if the number of contacts exceeds neither `capacity` nor the reservation,
  /// and every sphere is valid (all values finite, radius > 0). Otherwise, no contact is
  /// written; *d_count then contains the number to reserve, or the index of an invalid sphere.
  /// @param d_spheres device memory, aligned to 4 * sizeof(Real) bytes, unchanged until completion
  /// @param d_contacts device memory, aligned to 8 bytes (as d_pairs below); may be null if
  ///   `capacity` is 0
  /// @throws InvalidArgument if `n` exceeds the reservation or d_contacts is not aligned,
  /// DeviceError.
  void find_contacts(const SphereInstance* d_spheres, std::size_t n, SphereContact* d_contacts,
                     std::size_t capacity, ContactCount* d_count);
  /// Like find_contacts(), but writes only the indices: 8 bytes per contact.
  void find_pairs(const SphereInstance* d_spheres, std::size_t n, SpherePair* d_pairs,
                  std::size_t capacity, ContactCount* d_count);

  /// Enqueues the test of `m` given pairs: d_results[i] is the result of d_pairs[i], with Bullet's
  /// rules for NaN. Indices are not checked. @throws DeviceError
  void test_pairs(const SphereInstance* d_spheres, const SpherePair* d_pairs, std::size_t m,
                  PairResult* d_results);

  /// The algorithm of a search among `n` spheres; never `automatic`.
  SphereAlgorithm algorithm_for(std::size_t n) const noexcept;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace cuda
}  // namespace JFPX_ABI
}  // namespace jfpx
