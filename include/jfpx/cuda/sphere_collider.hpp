/// Sphere contacts at the level of a CUDA stream: device pointers in, device contacts out.
#pragma once

#include <jfpx/sphere_collider.hpp>

#include <cstddef>
#include <memory>

struct CUstream_st;

namespace jfpx {
inline namespace JFPX_ABI {
namespace cuda {

/// A cudaStream_t, without the CUDA headers.
using Stream = CUstream_st*;

inline constexpr std::uint32_t kNoSphere = 0xffffffffu;

/// What a search found. Lives in memory that the device can write: device or mapped host memory.
struct ContactCount {
  std::uint64_t contacts = 0;               ///< touching pairs; exact also when not complete
  std::uint32_t first_invalid = kNoSphere;  ///< lowest index with a value that is not allowed
  std::uint32_t complete = 0;               ///< 1: all contacts were written, 0: none was
};

/// Finds contacts on the device, in the order of one stream. No call but the constructor,
/// reserve() and the destructor allocates or waits, so that all others can be captured in a CUDA
/// graph; captured work stays valid until the next reserve() that grows a buffer.
/// Not thread-safe; objects are independent of each other, also on one device.
class JFPX_API DeviceSphereCollider {
 public:
  /// Works on `device`, enqueues on `stream`, which must belong to that device, outlive the object
  /// and not be capturing.
  /// @throws BackendUnavailable with the reason if the device can't be used, DeviceError;
  ///   BuildMismatch (build.hpp) by `headers`, which is to be left as it is.
  explicit DeviceSphereCollider(Stream stream, int device = 0,
                                SphereAlgorithm algorithm = SphereAlgorithm::automatic,
                                Build headers = Build::of_these_headers);
  ~DeviceSphereCollider();
  DeviceSphereCollider(DeviceSphereCollider&&) noexcept;
  DeviceSphereCollider& operator=(DeviceSphereCollider&&) noexcept;

  /// Makes room for searches with up to `spheres` spheres and `contacts` contacts. Grows only.
  /// @throws InvalidArgument for more than 2^31 spheres, OutOfMemory with the bytes needed,
  /// DeviceError; what was reserved before stays.
  void reserve(std::size_t spheres, std::size_t contacts);

  /// Enqueues the search for all touching pairs among `n` spheres. On completion *d_count is set
  /// and, if complete, d_contacts[0 .. contacts) hold them sorted by (a, b). They are complete if
  /// there are no more than `capacity` and than were reserved, and every sphere is valid (all
  /// values finite, radius > 0). Otherwise read *d_count, reserve, and enqueue again.
  /// @param d_spheres device memory, 4*sizeof(Real)-aligned, unchanged until completion
  /// @param d_contacts device memory, 8-aligned (as d_pairs below); may be null if `capacity` is 0
  /// @throws InvalidArgument if `n` is more than was reserved or an output is not aligned,
  /// DeviceError.
  void find_contacts(const SphereInstance* d_spheres, std::size_t n, SphereContact* d_contacts,
                     std::size_t capacity, ContactCount* d_count);
  /// The same, but writes 8 bytes a contact: the indices alone.
  void find_pairs(const SphereInstance* d_spheres, std::size_t n, SpherePair* d_pairs,
                  std::size_t capacity, ContactCount* d_count);

  /// Enqueues the test of `m` given pairs: d_results[i] belongs to d_pairs[i]. Bullet's rules for
  /// NaN; indices are not checked.
  void test_pairs(const SphereInstance* d_spheres, const SpherePair* d_pairs, std::size_t m,
                  PairResult* d_results);

  /// How a search among `n` spheres is done; never `automatic`.
  SphereAlgorithm algorithm_for(std::size_t n) const noexcept;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace cuda
}  // namespace JFPX_ABI
}  // namespace jfpx
