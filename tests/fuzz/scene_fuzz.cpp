/// Fuzz target for scene files: every text is a scene that round-trips through JSON bit for bit, or
/// an InvalidScene; and every scene can be stepped, with the same bits for every broad phase.
#include <jfpx/error.hpp>
#include <jfpx/world.hpp>

#include "tests/fuzz/fuzz.hpp"

#include <algorithm>
#include <optional>
#include <string_view>

namespace jfpx {
inline namespace JFPX_ABI {
namespace {

using fuzz::require;

/// Larger scenes take longer without testing more.
constexpr std::size_t kMaxBodies = 24, kMaxParts = 48;
constexpr int kSteps = 3;

std::optional<Scene> parsed(std::string_view text) {
  try {
    return from_json(text);
  } catch (const InvalidScene&) {
    return std::nullopt;
  }
}

bool is_small(const Scene& scene) {
  std::size_t parts = 0;
  for (const BodyDef& body : scene.bodies) {
    const auto* compound = std::get_if<Compound>(&body.shape);
    if (compound != nullptr) parts += compound->parts.size();
  }
  return scene.bodies.size() <= kMaxBodies && parts <= kMaxParts;
}

std::optional<World> made(const Scene& scene, BroadPhase broad_phase) {
  try {
    return World(scene, {.collider = {.backend = Backend::cpu}, .broad_phase = broad_phase});
  } catch (const InvalidScene&) {
    return std::nullopt;  // movable half-spaces and planes
  }
}

void step(const Scene& scene) {
  std::optional<World> world = made(scene, BroadPhase::cells);
  std::optional<World> other = made(scene, BroadPhase::hierarchy);
  require(world.has_value() == other.has_value(), "both worlds reject the scene, or none does");
  if (!world) return;
  for (int n = 0; n < kSteps; ++n) {
    const std::uint64_t before = world->state_hash();
    const StepReport report = world->step(), other_report = other->step();
    require(report.non_finite == other_report.non_finite, "both worlds report non-finite states");
    require(!report.non_finite || world->state_hash() == before, "a failed step is rolled back");
    require(world->state_hash() == other->state_hash(), "broad phases give the same states");
    require(std::ranges::equal(world->contacts(), other->contacts()),
            "broad phases give the same contacts");
    for (const BodyState& state : world->states()) {
      require(is_finite(state.position) && is_finite(state.orientation) &&
                  is_finite(state.velocity) && is_finite(state.angular_velocity),
              "states are finite");
    }
  }
}

}  // namespace
}  // namespace JFPX_ABI
}  // namespace jfpx

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace jfpx;
  std::optional<Scene> scene = parsed({reinterpret_cast<const char*>(data), size});
  if (!scene) return 0;
  const std::string text = to_json(*scene);
  const std::optional<Scene> again = parsed(text);
  fuzz::require(again && *again == *scene, "a scene round-trips through JSON");
  fuzz::require(to_json(*again) == text, "the JSON form of a scene is unique");
  if (!is_small(*scene)) return 0;
  // A large number of iterations is valid but would slow down the fuzzer.
  scene->resolver.max_iterations = std::min(scene->resolver.max_iterations, 500u);
  step(*scene);
  return 0;
}
