/// A cast of a solid to the bodies of a world.
#pragma once

#include <jfpx/query.hpp>

#include "src/collide/shape_cast.hpp"
#include "src/world/queries/query_tree.hpp"
#include "src/world/queries/solid_query.hpp"

#include <optional>

namespace jfpx {
inline namespace JFPX_ABI {

class BodyCast {
 public:
  /// @throws InvalidArgument
  explicit BodyCast(const ShapeCast& cast);

  /// Calls limit = visit(body) for the bodies that the solid may touch at a fraction of at most the
  /// current limit.
  template <class Visit>
  void visit_candidates(const QueryTree& tree, const Visit& visit) const {
    const Vec3 &from = solid_.pose.origin, &half = solid_.half_extents;
    const Real length = motion_.length;
    const auto visit_body = [&](std::uint32_t body) { return visit(body) * length; };
    if (length > 0) {
      tree.visit_swept(from, half, motion_.direction, length, visit_body);
    } else {
      tree.visit_around(from, half, visit);
    }
  }
  /// The hit of a body up to a fraction of the motion.
  std::optional<ShapeHit> hit_of(const BodyStore& bodies, std::uint32_t body, Real limit) const;

 private:
  QuerySolid solid_;
  detail::ConvexCore core_;
  detail::LinearMotion motion_;
};

}  // namespace JFPX_ABI
}  // namespace jfpx
