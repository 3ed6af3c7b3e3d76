/// The part of the preloaded engine that solves groups and updates AABBs.
#pragma once

#include <jfpx/config.hpp>

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {

/// Writes a summary of all work so far to stderr, with `prefix` before every line. Writes nothing
/// if there was no work.
void print_solver_summary(const char* prefix);

}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
