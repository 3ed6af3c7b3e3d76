/// Balls that fall into a box, on the GPU alone.
#pragma once

#include <jfpx/cuda/sphere_collider.hpp>

#include "src/viewer/drawing.hpp"

#include <cstdint>
#include <memory>

namespace jfpx {
inline namespace JFPX_ABI {
namespace cuda_view {

/// Position-based (Mueller and others 2007): balls move, touching ones are pushed apart, and what
/// came of it is the velocity. Pushes are added as whole numbers, so their order does not show and
/// a run has the same bits every time.
class Crowd {
 public:
  static constexpr Real kRadius = Real(0.5);    ///< [m]
  static constexpr Real kStep = Real(1) / 120;  ///< [s]

  /// @throws BackendUnavailable, DeviceError, OutOfMemory
  explicit Crowd(std::uint32_t balls);
  ~Crowd();
  Crowd(const Crowd&) = delete;
  Crowd& operator=(const Crowd&) = delete;

  void step();
  /// Enqueues what the renderer needs of each ball, relative to the eye.
  /// @param items memory that the device can write, for size() items
  void write_items(view::SphereItem* items, const Vec3& eye);

  cuda::Stream stream() const;
  std::uint32_t size() const;
  std::uint64_t contacts() const;  ///< in the last step
  Real side() const;               ///< edge of the box's floor [m]

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace cuda_view
}  // namespace JFPX_ABI
}  // namespace jfpx
