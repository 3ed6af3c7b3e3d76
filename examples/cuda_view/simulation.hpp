/// Simulation of balls that fall into a box, entirely on the GPU.
#pragma once

#include <jfpx/cuda/sphere_collider.hpp>

#include "src/viewer/drawing.hpp"

#include <cstdint>
#include <memory>

namespace jfpx {
inline namespace JFPX_ABI {
namespace cuda_view {

/// Position-based dynamics (Mueller and others 2007): balls move, overlapping balls are separated,
/// and the velocity is the difference of positions. Displacements are accumulated as integers, so
/// that their order is irrelevant and every run has the same bits.
class Simulation {
 public:
  static constexpr Real kRadius = Real(0.5);    ///< [m]
  static constexpr Real kStep = Real(1) / 120;  ///< [s]

  /// @throws BackendUnavailable, DeviceError, OutOfMemory
  explicit Simulation(std::uint32_t balls);
  ~Simulation();
  Simulation(const Simulation&) = delete;
  Simulation& operator=(const Simulation&) = delete;

  void step();
  /// Enqueues the conversion of the balls to items of the renderer, relative to the eye.
  /// @param items device memory for size() items
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
