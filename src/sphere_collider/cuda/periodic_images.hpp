/// Kernels of searches in periodic cells: centres are reduced to the cell, images that may touch a
/// sphere in the cell follow the spheres, and the pairs that are found get their shifts and
/// contacts.
#pragma once

#include "src/sphere_collider/cuda/contact_arrays.hpp"
#include "src/sphere_collider/cuda/search.hpp"
#include "src/sphere_collider/periodic_cell.hpp"

#include <cuda_runtime_api.h>

namespace jfpx {
inline namespace JFPX_ABI {
namespace cuda {

/// Properties of all spheres. All bytes are zero before launch_prepare(), which clears them at its
/// end for the next search.
struct PeriodicState {
  unsigned long long largest_radius;  ///< bits of the largest radius of the given spheres
  unsigned long long images;          ///< number of images, including those beyond the capacity
  std::uint32_t has_bad;        ///< 1: a sphere is invalid, too large for its cell or too far away
  std::uint32_t has_no_code;    ///< 1: a sphere is too far from the cell for a shift code
  std::uint32_t blocks_passed;  ///< blocks that have appended their images
};

/// The spheres of the last search in periodic cells, in device memory.
struct SpheresInCells {
  const SphereInstance* spheres = nullptr;  ///< as given
  // Of a search in one cell.
  PeriodicCell cell = {};
  const CellPoint* points = nullptr;
  const PeriodicSpheres* known = nullptr;
  // Of a search in systems, each of which has a cell.
  const PeriodicCell* cells = nullptr;     ///< [systems]
  const std::uint64_t* offsets = nullptr;  ///< [systems + 1] first spheres of the systems
  std::uint32_t systems = 0;
};

/// Arrays of a search in one cell, in device memory.
struct PeriodicArgs {
  PeriodicCell cell;
  detail::CellErrors errors;  ///< in the cell
  SphereArrays first, second;
  std::uint32_t n;          ///< number of spheres in both
  SphereInstance* given;    ///< [n] receives the spheres
  SphereInstance* reduced;  ///< [n] by detail::reduced(), then the images, up to the capacity
  CellPoint* points;        ///< [n]
  std::uint32_t* ids;       ///< [n + capacity] of the spheres and images
  unsigned index_bit;       ///< lowest bit of the index in an id
  std::uint32_t capacity;
  PeriodicSpheres* known;
  PeriodicState* state;
  unsigned long long* signal;  ///< in host memory: receives the number of images; see SearchSignal
};
/// Enqueues all of these arrays.
void launch_prepare(const PeriodicArgs& args, cudaStream_t stream);

/// Enqueues the contacts of n pairs that touch.
void launch_make_contacts(const SpheresInCells& in, const SpherePair* pairs, std::size_t n,
                          SphereContact* contacts, cudaStream_t stream);
/// Pairs as two rows of n indices: all a's, then all b's.
template <class Index>
struct PairRows {
  const Index* indices;
  std::uint64_t n;
};
/// Enqueues the output of the shifts of up to `capacity` pairs that touch: FoundItems or PairRows,
/// in either order.
template <class Pairs>
void launch_write_shifts(const SpheresInCells& in, const Pairs& found, std::int32_t* shifts,
                         std::size_t capacity, cudaStream_t stream);

}  // namespace cuda
}  // namespace JFPX_ABI
}  // namespace jfpx
