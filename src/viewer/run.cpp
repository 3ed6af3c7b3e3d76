/// Creation of runs.
#include "src/viewer/run.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace view {
namespace {

std::unique_ptr<Run> make_run_from(const Scene& scene, const EngineChoice& choice,
                                   std::uint64_t first_step) {
  if (choice.engine == EngineKind::native) {
    return detail::make_native_run(scene, choice, first_step);
  }
  return detail::make_bullet_run(scene, choice, first_step);
}

}  // namespace

std::unique_ptr<Run> make_run(const Scene& scene, const EngineChoice& choice) {
  return make_run_from(scene, choice, 0);
}

std::unique_ptr<Run> continue_run(const Scene& scene, const RunState& from,
                                  const EngineChoice& choice) {
  return make_run_from(with_states(scene, from.states), choice, from.step);
}

Scene with_states(const Scene& scene, const std::vector<BodyState>& states) {
  Scene moved = scene;
  for (std::size_t i = 0; i < moved.bodies.size(); ++i) {
    BodyDef& body = moved.bodies[i];
    if (body.mass == 0 && !body.kinematic) continue;
    body.position = states[i].position;
    body.orientation = states[i].orientation;
    body.velocity = states[i].velocity;
    body.angular_velocity = states[i].angular_velocity;
  }
  return moved;
}

}  // namespace view
}  // namespace JFPX_ABI
}  // namespace jfpx
