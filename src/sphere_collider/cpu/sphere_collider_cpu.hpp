/// The CPU row of the backend table.
#pragma once

#include <jfpx/sphere_collider.hpp>

#include "src/base/thread_pool.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace cpu {

BackendStatus probe();
/// @param pool null: the collider creates options.threads threads
std::unique_ptr<SphereCollider> make_sphere_collider(const SphereColliderOptions& options,
                                                     ThreadPool* pool);

}  // namespace cpu
}  // namespace JFPX_ABI
}  // namespace jfpx
