/// Pair tests of jfpx/collide.hpp that are not inline.
#include <jfpx/collide.hpp>

#include "src/collide/box_pair.hpp"

namespace jfpx {
inline namespace JFPX_ABI {

Manifold collide(const Box& a, const Transform& pose_a, const Box& b, const Transform& pose_b) {
  return detail::collide_boxes(a, pose_a, b, pose_b);
}

}  // namespace JFPX_ABI
}  // namespace jfpx
