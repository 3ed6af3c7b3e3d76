/// Spheres as columns for the kernels, in an order chosen by the caller.
#pragma once

#include <jfpx/math.hpp>
#include <jfpx/shape.hpp>

#include "src/base/buffer.hpp"
#include "src/base/parallel_for.hpp"
#include "src/sphere_collider/cpu/kernels.hpp"

#include <limits>
#include <span>

namespace jfpx {
inline namespace JFPX_ABI {
namespace cpu {

/// Returns the extended radius of the filter (kernels.inl): at least r*(1 + 6u) + t and at most
/// r*(1 + 15u) + 3t, with u = epsilon/2 and t = the root of the smallest normal number. Uses twice
/// the least slack, to cover its own rounding.
inline Real extended_radius(Real r) {
  static const Real slack = 2 * square_root(std::numeric_limits<Real>::min());
  return r * (1 + 6 * kEpsilon) + slack;
}

/// Owns the columns, which grow and never shrink.
class SphereTable {
 public:
  /// Element i becomes sphere id_of(i) in cell cell_of(i).
  template <class Id, class Cell>
  void fill(ThreadPool& pool, std::span<const SphereInstance> spheres, std::size_t count,
            const Id& id_of, const Cell& cell_of) {
    reserve(count + kMaxLanes);
    count_ = static_cast<std::uint32_t>(count);
    parallel_for(&pool, count, chunk_size(count, 128, 2048),
                 [&](std::size_t first, std::size_t last) {
                   for (std::size_t i = first; i < last; ++i) {
                     const std::uint32_t id = id_of(i);
                     set(i, spheres[id], id, cell_of(i));
                   }
                 });
    for (std::size_t i = count; i < count + kMaxLanes; ++i) set(i, {}, 0, kNoCell);
  }

  std::uint32_t count() const noexcept { return count_; }
  SphereColumns columns() const noexcept {
    return {x_.data(),     y_.data(),  z_.data(),    radius_.data(),
            reach_.data(), id_.data(), cell_.data(), count_};
  }

 private:
  void reserve(std::size_t count) {
    for (Buffer<Real>* column : {&x_, &y_, &z_, &radius_, &reach_}) {
      column->reserve(count, "coordinates of spheres");
    }
    id_.reserve(count, "indices of spheres");
    cell_.reserve(count, "cells of spheres");
  }
  void set(std::size_t i, const SphereInstance& s, std::uint32_t id, std::int64_t cell) {
    x_[i] = s.centre.x;
    y_[i] = s.centre.y;
    z_[i] = s.centre.z;
    radius_[i] = s.radius;
    reach_[i] = extended_radius(s.radius);
    id_[i] = id;
    cell_[i] = cell;
  }

  Buffer<Real> x_, y_, z_, radius_, reach_;
  Buffer<std::uint32_t> id_;
  Buffer<std::int64_t> cell_;
  std::uint32_t count_ = 0;
};

}  // namespace cpu
}  // namespace JFPX_ABI
}  // namespace jfpx
