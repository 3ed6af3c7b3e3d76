/// Pair tests that are too long for a header.
#include <jfpx/collide.hpp>

#include "src/shared/box_pair.hpp"

namespace jfpx::inline JFPX_ABI {

Manifold collide(const Box& a, const Transform& pose_a, const Box& b, const Transform& pose_b) {
  return shared::collide_boxes(a, pose_a, b, pose_b);
}

}  // namespace jfpx::inline JFPX_ABI
