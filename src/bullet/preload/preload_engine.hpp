/// What libjfpx-bullet-preload asks of the engine of one precision, which it loads at run time.
#pragma once

namespace jfpx::preload {

/// Does the dispatch as a batch; false if it must be left to Bullet. The pointers are those of
/// btCollisionDispatcher::dispatchAllCollisionPairs: the dispatcher, the pair cache, the
/// btDispatcherInfo and the btDispatcher.
using TryDispatch = bool (*)(void* dispatcher, void* pair_cache, const void* info, void* argument);
inline constexpr char kTryDispatch[] = "jfpx_preload_try_dispatch";

/// Solves the group; false if it must be left to Bullet. The arguments are those of
/// btSequentialImpulseConstraintSolver::solveGroup.
using TrySolve = bool (*)(void* solver, void** bodies, int body_count, void** manifolds,
                          int manifold_count, void** joints, int joint_count, const void* info,
                          void* drawer, void* dispatcher);
inline constexpr char kTrySolve[] = "jfpx_preload_try_solve";

/// Updates the boxes; false if that must be left to Bullet. The argument is that of
/// btCollisionWorld::updateAabbs.
using TryUpdateBoxes = bool (*)(void* world);
inline constexpr char kTryUpdateBoxes[] = "jfpx_preload_try_update_boxes";

/// Writes what was done so far to stderr, every line after `prefix`.
using PrintSummary = void (*)(const char* prefix);
inline constexpr char kPrintSummary[] = "jfpx_preload_print_summary";

}  // namespace jfpx::preload
