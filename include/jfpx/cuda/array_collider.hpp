/// Sphere collider for arrays in device memory in the layout of other libraries: separate arrays of
/// positions and radii as input, separate arrays of indices, normals and distances as output.
#pragma once

#include <jfpx/cuda/sphere_collider.hpp>
#include <jfpx/periodic.hpp>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>

namespace jfpx {
inline namespace JFPX_ABI {
namespace cuda {

/// Spheres in device memory. Strides count elements.
struct SphereArrays {
  std::size_t count = 0;
  const Real* positions = nullptr;  ///< [m]: positions[i * row_stride + k * column_stride]
  std::ptrdiff_t row_stride = 3, column_stride = 1;
  const Real* radii = nullptr;  ///< [m], > 0: radii[i * radius_stride]; null: all have `radius`
  std::ptrdiff_t radius_stride = 1;
  Real radius = 0;  ///< [m], > 0
};

/// Kind of the result of a search.
enum class ArrayResult : std::uint8_t {
  pairs,    ///< indices alone
  contacts  ///< with normals and distances
};

/// Finds contacts of arrays. Reads and writes arrays in the order of the caller's stream, and keeps
/// the result of the last search until the next one. Calls on one object must use one stream, or
/// streams that the caller orders. Not thread-safe; objects are independent of each other.
class JFPX_API ArrayCollider {
 public:
  /// @throws BackendUnavailable with the reason if the device cannot be used, DeviceError
  explicit ArrayCollider(int device = 0, SphereAlgorithm algorithm = SphereAlgorithm::automatic);
  ~ArrayCollider();
  ArrayCollider(ArrayCollider&&) noexcept;
  ArrayCollider& operator=(ArrayCollider&&) noexcept;

  /// Reserves memory for enqueue(). The other searches reserve what they need.
  /// @throws InvalidArgument for more than 2^31 spheres, OutOfMemory, DeviceError
  void reserve(std::size_t spheres, std::size_t contacts);

  /// Finds all touching pairs, sorted by (a, b), and waits for their number, which is returned.
  /// @param both_orders also lists (b, a), with the opposite normal
  /// @throws InvalidArgument naming the first invalid sphere and field, OutOfMemory, DeviceError
  std::uint64_t find(const SphereArrays& spheres, ArrayResult result, bool both_orders,
                     Stream stream);
  /// Finds the pairs of find(), without both orders, and returns their number E. If E is at most
  /// `capacity`, writes the indices a to indices[0 .. E) and the indices b to indices[E .. 2 * E).
  /// Waits only for the number: the indices are written in the order of the stream. The result is
  /// not kept, which saves its memory and the time of write_pairs().
  /// @param indices room for 2 * capacity elements, in device memory
  /// @throws the exceptions of find()
  std::uint64_t find_pairs(const SphereArrays& spheres, std::int32_t* indices, std::size_t capacity,
                           Stream stream);
  std::uint64_t find_pairs(const SphereArrays& spheres, std::int64_t* indices, std::size_t capacity,
                           Stream stream);
  /// Finds the touching pairs of a sphere of `first` and one of `second`; see
  /// jfpx::find_contacts_between().
  /// @throws the exceptions of find()
  std::uint64_t find_between(const SphereArrays& first, const SphereArrays& second,
                             ArrayResult result, Stream stream);
  /// Finds the contacts within each of many systems; see jfpx::find_contacts_in_systems(). Tests
  /// all pairs of each system.
  /// @param offsets in host memory
  /// @throws the exceptions of find(); InvalidArgument also for invalid offsets
  std::uint64_t find_in_systems(const SphereArrays& spheres, std::span<const std::uint64_t> offsets,
                                ArrayResult result, bool both_orders, Stream stream);
  /// Finds the touching pairs in a periodic cell; see jfpx::find_periodic_contacts().
  /// @throws InvalidArgument like that function; OutOfMemory, DeviceError
  std::uint64_t find_periodic(const SphereArrays& spheres, const PeriodicCell& cell,
                              ArrayResult result, bool both_orders, Stream stream);
  /// Finds the pairs of find_periodic(), without both orders, and writes them like find_pairs(),
  /// and the shifts of pair i to shifts[3 * i .. 3 * i + 3).
  /// @param indices, shifts room for 2 * capacity and 3 * capacity elements, in device memory
  /// @throws the exceptions of find_periodic()
  std::uint64_t find_periodic_pairs(const SphereArrays& spheres, const PeriodicCell& cell,
                                    std::int32_t* indices, std::int32_t* shifts,
                                    std::size_t capacity, Stream stream);
  std::uint64_t find_periodic_pairs(const SphereArrays& spheres, const PeriodicCell& cell,
                                    std::int64_t* indices, std::int32_t* shifts,
                                    std::size_t capacity, Stream stream);
  /// Finds the touching pairs within each of many periodic systems; see
  /// jfpx::find_periodic_contacts_in_systems(). Tests all pairs of each system.
  /// @param offsets, cells in host memory
  /// @throws the exceptions of find_periodic(); InvalidArgument also for invalid offsets or another
  ///   number of cells
  std::uint64_t find_periodic_in_systems(const SphereArrays& spheres,
                                         std::span<const std::uint64_t> offsets,
                                         std::span<const PeriodicCell> cells, ArrayResult result,
                                         bool both_orders, Stream stream);
  /// Finds the touching pairs between two sets; see jfpx::find_periodic_contacts_between().
  /// @throws the exceptions of find_periodic()
  std::uint64_t find_periodic_between(const SphereArrays& first, const SphereArrays& second,
                                      const PeriodicCell& cell, ArrayResult result, Stream stream);
  /// Enqueues find() without both_orders. Neither allocates nor waits, so that the call and the
  /// writes below can be captured in a CUDA graph. If the number of contacts exceeds the
  /// reservation, or a sphere is invalid, only the count is written. A captured graph is valid
  /// until another call reserves more memory.
  /// @throws InvalidArgument for more spheres than are reserved, DeviceError
  void enqueue(const SphereArrays& spheres, ArrayResult result, Stream stream);

  /// Enqueue the output of the last search to device memory. Each array has room for `capacity`
  /// contacts; further contacts are dropped. @throws DeviceError, here and below
  void write_pairs(std::int32_t* a, std::int32_t* b, std::size_t capacity, Stream stream);
  void write_pairs(std::int64_t* a, std::int64_t* b, std::size_t capacity, Stream stream);
  /// @param normals 3 * capacity elements
  /// @throws InvalidArgument if the search was for pairs
  void write_contacts(Real* normals, Real* distances, std::size_t capacity, Stream stream);
  /// @param shifts 3 * capacity elements: the image of b is displaced by shift * lengths
  /// @throws InvalidArgument if the search was not in a periodic cell
  void write_shifts(std::int32_t* shifts, std::size_t capacity, Stream stream);
  /// Writes the offsets of compressed rows, one more than the spheres of the (first) set. Must not
  /// follow enqueue().
  void write_offsets(std::int64_t* offsets, Stream stream);
  /// Writes {number of contacts, 1 if all of them were found and 0 otherwise}.
  void write_count(std::int64_t* count, Stream stream);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace cuda
}  // namespace JFPX_ABI
}  // namespace jfpx
