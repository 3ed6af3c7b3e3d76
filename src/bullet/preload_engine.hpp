/// What libjfpx-bullet-preload asks of the engine of one precision, which it loads at run time.
#pragma once

namespace jfpx::preload {

/// Does the dispatch as a batch; false if it must be left to Bullet. The pointers are those of
/// btCollisionDispatcher::dispatchAllCollisionPairs: the dispatcher, the pair cache, the
/// btDispatcherInfo and the btDispatcher.
using TryDispatch = bool (*)(void* dispatcher, void* pair_cache, const void* info, void* argument);
inline constexpr char kTryDispatch[] = "jfpx_preload_try_dispatch";

/// Writes what was done so far to stderr, every line after `prefix`.
using PrintSummary = void (*)(const char* prefix);
inline constexpr char kPrintSummary[] = "jfpx_preload_print_summary";

}  // namespace jfpx::preload
