/// Continuous collision on the CPU. A source of its own, because compilers inline less of the rest
/// of a step beside it.
#include "src/world/step/continuous_collision.hpp"

#include "src/base/pool_team.hpp"
#include "src/world/step/soft_step.hpp"

namespace jfpx {
inline namespace JFPX_ABI {

void SoftStep::stop_fast_bodies(const BodyStore& bodies, const SubShapeView& sub_shapes,
                                const FixedTreesView& trees,
                                std::span<const std::uint32_t> tested) {
  const std::span<const std::uint32_t> mobile = moved(bodies);
  std::uint32_t any_fast = 0;
  ContinuousCollision{step_,
                      sub_shapes,
                      trees,
                      ranks_ == nullptr ? nullptr : tested.data(),
                      static_cast<std::uint32_t>(tested.size()),
                      ignored_.keys().data(),
                      static_cast<std::uint32_t>(ignored_.keys().size())}
      .run(
          PoolTeam(pool_), static_cast<std::uint32_t>(mobile.size()),
          [mobile](std::uint32_t i) { return mobile[i]; }, &any_fast);
}

}  // namespace JFPX_ABI
}  // namespace jfpx
