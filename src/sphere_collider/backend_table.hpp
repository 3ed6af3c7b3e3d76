/// The backend table: probes and factories of all backends.
#pragma once

#include <jfpx/backend.hpp>
#include <jfpx/sphere_collider.hpp>

#include "src/base/thread_pool.hpp"

namespace jfpx {
inline namespace JFPX_ABI {

struct BackendRow {
  Backend backend;
  bool compiled;
  BackendStatus (*probe)();  ///< does not throw for a missing device
  /// If the pool is null, the CPU backend creates its own pool.
  std::unique_ptr<SphereCollider> (*make_sphere_collider)(const SphereColliderOptions&,
                                                          ThreadPool* pool);
};

/// Creates a collider whose CPU backend runs on the given pool, which is shared with the caller,
/// instead of on `options.threads` threads of its own.
/// @param pool outlives the collider; calls of the collider and other uses must not overlap
/// @throws the exceptions of make_sphere_collider(options)
std::unique_ptr<SphereCollider> make_sphere_collider(const SphereColliderOptions& options,
                                                     ThreadPool* pool);

/// Returns the row of a backend other than `automatic`.
/// @throws InvalidArgument for `automatic` and invalid values
JFPX_API const BackendRow& backend_row(Backend backend);

}  // namespace JFPX_ABI
}  // namespace jfpx
