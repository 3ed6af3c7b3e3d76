/// The part of the preloaded engine that solves groups and updates AABBs.
#pragma once

#include <jfpx/config.hpp>

#include <cstdio>

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {

/// Writes a summary of all work so far, with `prefix` before every line. Writes nothing if there
/// was no work.
void print_solver_summary(std::FILE* to, const char* prefix);

}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
