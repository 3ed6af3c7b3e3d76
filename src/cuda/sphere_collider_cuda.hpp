/// The cuda row of the backend table.
#pragma once

#include <jfpx/sphere_collider.hpp>

namespace jfpx::inline JFPX_ABI::cuda {

std::unique_ptr<SphereCollider> make_sphere_collider(const SphereColliderOptions& options);

}  // namespace jfpx::inline JFPX_ABI::cuda
