/// Update of the manifolds of a pair with a compound.
#pragma once

#include "src/bullet/dispatch/convex_commit.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {

/// Whether the algorithm is exactly a btCompoundCompoundCollisionAlgorithm or a
/// btCompoundCollisionAlgorithm. False for null.
bool is_compound_algorithm(const btCollisionAlgorithm* algorithm);

/// Prefetches what commit_compound() reads next of an algorithm that is in the cache.
void prefetch_children(const btCollisionAlgorithm& algorithm);

/// Updates the manifolds of pair i, which has such an algorithm, on the calling thread. Bullet must
/// process pairs whose children begin or cease to overlap, because it then creates or releases
/// manifolds, and those with more than a few children or with children of other classes.
/// @return false, without a change, if Bullet must process the pair
bool commit_compound(const ConvexDispatch& dispatch, std::size_t i, CommitCounts* counts);

}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
