/// The balls of a world on a CUDA device, for pictures.
#pragma once

#include <jfpx/world.hpp>

#include "src/viewer/resident_spheres.hpp"

#include <memory>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace view {

/// A body that is drawn as a sphere.
struct Ball {
  std::uint32_t body;  ///< BodyId::index
  float radius;        ///< [m]
  Paint paint;
};

/// @param world outlives the result; no body is added or removed
/// @throws BackendUnavailable, also in a build without CUDA; DeviceError, OutOfMemory
std::unique_ptr<ResidentSpheres> make_world_spheres(World* world, const std::vector<Ball>& balls);

}  // namespace view
}  // namespace JFPX_ABI
}  // namespace jfpx
