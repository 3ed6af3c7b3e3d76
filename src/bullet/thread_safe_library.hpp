/// Whether the Bullet library of this process is compiled with BT_THREADSAFE. Neither Bullet's
/// headers nor its pkg-config file contain this flag.
#pragma once

#include <jfpx/config.hpp>

class btCollisionObject;

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {

/// The first call tests the library; later calls return the same result. Thread-safe.
bool is_thread_safe_library();

/// Whether a solver with BT_THREADSAFE may treat the object differently. Such a solver tests the
/// collision flags instead of the mass to decide whether a body moves. It also stores the solver
/// bodies of kinematic bodies in a table instead of in their companion ids. They may then exist
/// twice, which has no effect unless impulses change them.
bool depends_on_thread_safety(const btCollisionObject& object);

}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
