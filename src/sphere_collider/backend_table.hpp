/// The backend table: probes and factories of all backends.
#pragma once

#include <jfpx/backend.hpp>
#include <jfpx/sphere_collider.hpp>

namespace jfpx {
inline namespace JFPX_ABI {

struct BackendRow {
  Backend backend;
  bool compiled;
  BackendStatus (*probe)();  ///< does not throw for a missing device
  std::unique_ptr<SphereCollider> (*make_sphere_collider)(const SphereColliderOptions&);
};

/// Returns the row of a backend other than `automatic`.
/// @throws InvalidArgument for `automatic` and invalid values
JFPX_API const BackendRow& backend_row(Backend backend);

}  // namespace JFPX_ABI
}  // namespace jfpx
