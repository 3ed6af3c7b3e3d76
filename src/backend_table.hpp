/// The backend table: who there is, whether it can be used, and how its parts are made.
#pragma once

#include <jfpx/backend.hpp>
#include <jfpx/sphere_collider.hpp>

namespace jfpx::inline JFPX_ABI {

struct BackendRow {
  Backend backend;
  BackendStatus (*probe)();  ///< never throws for a missing device
  std::unique_ptr<SphereCollider> (*make_sphere_collider)(const SphereColliderOptions&);
};

/// The row that serves `backend`; `automatic` is resolved here.
/// @throws BackendUnavailable with the reason if that backend can't be used.
const BackendRow& backend_row(Backend backend);

}  // namespace jfpx::inline JFPX_ABI
