/// Factory of the CUDA sphere collider, for the table of backends.
#pragma once

#include <jfpx/sphere_collider.hpp>

namespace jfpx {
inline namespace JFPX_ABI {
namespace cuda {

std::unique_ptr<SphereCollider> make_sphere_collider(const SphereColliderOptions& options);

}  // namespace cuda
}  // namespace JFPX_ABI
}  // namespace jfpx
