/// Makes sphere colliders: resolves the backend and checks the options.
#include <jfpx/error.hpp>
#include <jfpx/sphere_collider.hpp>

#include "src/backend_table.hpp"

namespace jfpx::inline JFPX_ABI {

SphereCollider::~SphereCollider() = default;

std::unique_ptr<SphereCollider> make_sphere_collider(const SphereColliderOptions& options) {
  if (options.threads > 256) {
    throw InvalidArgument("threads is " + std::to_string(options.threads) +
                          "; it must be 0 (one per core) to 256");
  }
  return backend_row(options.backend).make_sphere_collider(options);
}

}  // namespace jfpx::inline JFPX_ABI
