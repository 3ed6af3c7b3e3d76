/// Interface between libjfpx-bullet-preload and the engine of one precision that it loads.
#pragma once

#include <cstdio>

namespace jfpx::preload {

/// Runs the dispatch as a batch; returns false if Bullet must run it. The pointers are those of
/// btCollisionDispatcher::dispatchAllCollisionPairs: the dispatcher, the pair cache, the
/// btDispatcherInfo and the btDispatcher.
using TryDispatch = bool (*)(void* dispatcher, void* pair_cache, const void* info, void* argument);
inline constexpr char kTryDispatch[] = "jfpx_preload_try_dispatch";

/// Solves the group; returns false if Bullet must solve it. The arguments are those of
/// btSequentialImpulseConstraintSolver::solveGroup.
using TrySolve = bool (*)(void* solver, void** bodies, int body_count, void** manifolds,
                          int manifold_count, void** joints, int joint_count, const void* info,
                          void* drawer, void* dispatcher);
inline constexpr char kTrySolve[] = "jfpx_preload_try_solve";

/// Updates the AABBs; returns false if Bullet must do so. The argument is the object of
/// btCollisionWorld::updateAabbs.
using TryUpdateBoxes = bool (*)(void* world);
inline constexpr char kTryUpdateBoxes[] = "jfpx_preload_try_update_boxes";

/// Writes a summary of all work so far; every line starts with `prefix`.
using PrintSummary = void (*)(std::FILE* to, const char* prefix);
inline constexpr char kPrintSummary[] = "jfpx_preload_print_summary";

}  // namespace jfpx::preload
