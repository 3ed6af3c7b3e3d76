/// The backend table: which backends exist, whether they can be used, and how to make their
/// colliders.
#pragma once

#include <jfpx/backend.hpp>
#include <jfpx/sphere_collider.hpp>

namespace jfpx {
inline namespace JFPX_ABI {

struct BackendRow {
  Backend backend;
  bool compiled;
  BackendStatus (*probe)();  ///< never throws for a missing device
  std::unique_ptr<SphereCollider> (*make_sphere_collider)(const SphereColliderOptions&);
};

/// The row of a backend, which is not `automatic`. @throws InvalidArgument
JFPX_API const BackendRow& backend_row(Backend backend);

}  // namespace JFPX_ABI
}  // namespace jfpx
