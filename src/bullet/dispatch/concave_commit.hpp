/// Update of the manifold of a pair of a convex and a concave shape.
#pragma once

#include "src/bullet/dispatch/convex_commit.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {

/// Updates the manifold of pair i, whose kind is convex_concave or concave_convex, on the calling
/// thread, like btConvexConcaveCollisionAlgorithm. Spheres are computed without Bullet's
/// algorithms; for other convex shapes, Bullet's btConvexConvexAlgorithm runs for each triangle.
/// @param is_convex whether the convex shape has one of the classes of kConvex
/// @return false, without a change, if Bullet must process the pair; `*counts` has the reason
bool commit_concave(const ConvexDispatch& dispatch, std::size_t i, bool is_convex,
                    CommitCounts* counts);
/// The same for a sphere whose contacts the user's callbacks observe, on the thread that
/// dispatches.
bool commit_concave_in_order(const ConvexDispatch& dispatch, std::size_t i, CommitCounts* counts);

}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
