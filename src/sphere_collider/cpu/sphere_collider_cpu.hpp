/// The CPU row of the backend table.
#pragma once

#include <jfpx/sphere_collider.hpp>

namespace jfpx {
inline namespace JFPX_ABI {
namespace cpu {

BackendStatus probe();
std::unique_ptr<SphereCollider> make_sphere_collider(const SphereColliderOptions& options);

}  // namespace cpu
}  // namespace JFPX_ABI
}  // namespace jfpx
