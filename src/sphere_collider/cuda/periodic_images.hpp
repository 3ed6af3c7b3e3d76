/// Kernels of a search in a periodic cell: centres are reduced to the cell, images that may touch a
/// sphere in the cell follow the spheres, and the pairs of a search among all of them become pairs
/// of the nearest images.
#pragma once

#include "src/sphere_collider/cuda/contact_arrays.hpp"
#include "src/sphere_collider/periodic_cell.hpp"

#include <cuda_runtime_api.h>

namespace jfpx {
inline namespace JFPX_ABI {
namespace cuda {

using detail::PeriodicImage;

/// Properties of all spheres. All bytes are zero before launch_reduce().
struct PeriodicState {
  unsigned long long largest_radius;  ///< bits of the largest radius of `reduced`
  unsigned long long has_bad;  ///< 1: a sphere is invalid, too large for its cell or too far away
};

/// A given sphere, and the cells that its reduced one was displaced by. In float, one memory
/// sector.
struct alignas(32) DisplacedSphere {
  SphereInstance sphere;
  ImageShift displacement;
};

/// Arrays in device memory.
struct PeriodicArgs {
  PeriodicCell cell;             ///< of all spheres, if there are no systems
  const PeriodicCell* cells;     ///< [systems]
  const std::uint64_t* offsets;  ///< [systems + 1] first spheres of the systems
  std::uint32_t systems;
  std::uint32_t n;
  DisplacedSphere* given;            ///< [n]
  SphereInstance* reduced;           ///< [n] by detail::reduced()
  std::uint32_t* counts;             ///< [n + 1] numbers of images, and a 0
  const unsigned long long* begins;  ///< [n + 1] exclusive scan of `counts`
  PeriodicImage* images;             ///< [begins[n]]
  PeriodicState* state;
};
/// Enqueues `given`, `reduced` and `state`.
void launch_reduce(const PeriodicArgs& args, const SphereInstance* spheres, cudaStream_t stream);
/// Enqueues `counts`.
void launch_count_images(const PeriodicArgs& args, cudaStream_t stream);
/// Enqueues `images`, and `spheres`: the reduced ones, then the images.
void launch_append_images(const PeriodicArgs& args, SphereInstance* spheres, cudaStream_t stream);

/// Enqueues kept[i] = 1 for each item that is a pair of two spheres a < b, or of a sphere a and an
/// image of a sphere b > a, that touch by detail::touch_at(), and has the lowest shift of all such
/// items of (a, b); else 0. Replaces the normals and distances of the kept items by the exact ones.
/// @param items [n] sorted pairs among the reduced spheres and their images
/// @param kept [n + 1], of which the last is 0
template <class Item>
void launch_mark_kept(const PeriodicArgs& args, Item* items, std::size_t n, std::uint32_t* kept,
                      cudaStream_t stream);
/// Enqueues the kept items, sorted by (a, b), with their shifts and their number.
/// @param places [n + 1] exclusive scan of `kept`
template <class Item>
void launch_place_kept(const PeriodicArgs& args, const Item* items, std::size_t n,
                       const std::uint32_t* kept, const unsigned long long* places, Item* out,
                       ImageShift* shifts, ContactCount* count, cudaStream_t stream);

/// Enqueues the output of the shifts of up to `capacity` items.
/// @param found items of `half`, or their opposites, of known number
/// @param half sorted pairs a < b, of known number
/// @param half_shifts the shifts of `half`
template <class Item>
void launch_write_shifts(const FoundItems<Item>& found, const FoundItems<Item>& half,
                         const ImageShift* half_shifts, std::int32_t* shifts, std::size_t capacity,
                         cudaStream_t stream);

}  // namespace cuda
}  // namespace JFPX_ABI
}  // namespace jfpx
