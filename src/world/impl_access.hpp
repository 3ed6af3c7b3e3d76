/// Access to the members of a World, for jfpx_thesis, tests, cuda::device_states() and the Python
/// package.
#pragma once

#include <jfpx/world.hpp>

namespace jfpx {
inline namespace JFPX_ABI {

struct WorldAccess {
  using Impl = World::Impl;
  static Impl& impl(World& world) { return *world.impl_; }
  static const Impl& impl(const World& world) { return *world.impl_; }
};

}  // namespace JFPX_ABI
}  // namespace jfpx
