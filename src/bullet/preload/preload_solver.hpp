/// The part of the preloaded engine that solves groups and updates boxes.
#pragma once

#include <jfpx/config.hpp>

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {

/// Writes what was done so far to stderr, every line after `prefix`; nothing where nothing was.
void print_solver_summary(const char* prefix);

}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
