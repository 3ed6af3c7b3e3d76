/// Distances of a solid from the bodies of a world.
#pragma once

#include <jfpx/query.hpp>

#include "src/collide/closest_points.hpp"
#include "src/world/queries/query_tree.hpp"
#include "src/world/queries/solid_query.hpp"

#include <optional>

namespace jfpx {
inline namespace JFPX_ABI {

class BodyGap {
 public:
  /// @throws InvalidArgument
  explicit BodyGap(const DistanceQuery& query);

  /// Calls limit = visit(body) for the bodies whose distance may be at most the current limit [m].
  template <class Visit>
  void visit_candidates(const QueryTree& tree, Real limit, const Visit& visit) const {
    tree.visit_nearby(solid_.pose.origin, half_extents_, limit, visit);
  }
  /// The distance of a body if it is at most a limit [m]. @param limit >= 0
  std::optional<BodyDistance> to(const BodyStore& bodies, std::uint32_t body, Real limit) const;

 private:
  detail::PlacedSolid solid_;
  Vec3 half_extents_;
};

}  // namespace JFPX_ABI
}  // namespace jfpx
