/// The backend table: who there is, whether it can be used, and how its parts are made.
#pragma once

#include <jfpx/backend.hpp>
#include <jfpx/sphere_collider.hpp>

#include "src/group_solver.hpp"

namespace jfpx::inline JFPX_ABI {

struct BackendRow {
  Backend backend;
  bool compiled;
  BackendStatus (*probe)();  ///< never throws for a missing device
  std::unique_ptr<SphereCollider> (*make_sphere_collider)(const SphereColliderOptions&);
  /// Null where groups are solved row by row: by the processor itself.
  std::unique_ptr<GroupSolver> (*make_group_solver)(int device);
};

/// The row of a backend, which is not `automatic`. @throws InvalidArgument
JFPX_API const BackendRow& backend_row(Backend backend);

}  // namespace jfpx::inline JFPX_ABI
