/// Tests whether a dispatcher is of a class without user code.
#pragma once

#include <jfpx/bullet/dispatcher.hpp>

#include "src/bullet/exact_class.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {

/// False for a user-defined class, which may override access to the manifolds, and whose overrides
/// need not be thread-safe.
inline bool is_plain(const btDispatcher& dispatcher) {
  return is_exactly<btCollisionDispatcher>(dispatcher) ||
         is_exactly<CollisionDispatcher>(dispatcher);
}

}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
