/// Demo of any scene, whose only control is a restart; and the demo boxes-and-balls.
#include <jfpx/thesis/worst_first.hpp>

#include "src/demos/makers.hpp"

#include <algorithm>
#include <array>
#include <utility>

namespace jfpx {
inline namespace JFPX_ABI {
namespace demos {
namespace {

constexpr Control kSceneControls[] = {{"reset", "restart", "r"}};

constexpr std::array<Colour, 4> kColours{
    {{0.80F, 0.35F, 0.25F}, {0.30F, 0.55F, 0.80F}, {0.45F, 0.70F, 0.35F}, {0.85F, 0.70F, 0.30F}}};

/// A camera that looks along -z and shows all movable bodies.
Camera camera_for(const Scene& scene) {
  Aabb bounds;
  for (const BodyDef& body : scene.bodies) {
    if (body.mass > 0) bounds = merged(bounds, {body.position, body.position});
  }
  if (!overlap(bounds, bounds)) return {};
  const Vec3 size = bounds.upper - bounds.lower, centre = (bounds.upper + bounds.lower) * Real(0.5);
  const Real extent = std::max({size.x, size.y, size.z}) + 5;
  return {.eye = centre + Vec3{0, extent * Real(0.4), extent * Real(1.3)}, .target = centre};
}

class SceneDemo final : public Demo {
 public:
  SceneDemo(Scene scene, const WorldSettings& settings, const Camera& camera, int ground_lines)
      : Demo(kSceneControls),
        scene_(std::move(scene)),
        settings_(settings),
        camera_(camera),
        ground_lines_(ground_lines),
        world_(scene_, settings_) {}

  std::string_view name() const override { return scene_.name; }
  Real dt() const override { return scene_.dt; }
  std::vector<BodyState> states() const override { return world_.states(); }
  const World* world() const override { return &world_; }
  const Scene* scene() const override { return &scene_; }

  void draw(View* view) const override {
    *view = {};
    view->camera = camera_;
    add_ground_lines(view, 50, 3, ground_lines_);
    const std::vector<BodyState> states = world_.states();
    for (std::size_t i = 0; i < states.size(); ++i) {
      const BodyDef& def = scene_.bodies[i];
      if (def.mass == 0) continue;  // walls would hide the bodies between them
      view->items.push_back({.shape = def.shape,
                             .position = states[i].position,
                             .orientation = states[i].orientation,
                             .colour = kColours[i % kColours.size()]});
    }
  }

 private:
  void act(std::size_t) override { world_ = World(scene_, settings_); }
  StepReport advance() override { return world_.step(); }

  Scene scene_;
  WorldSettings settings_;
  Camera camera_;
  int ground_lines_;
  World world_;
};

}  // namespace

std::unique_ptr<Demo> make(const Scene& scene, const WorldSettings& settings) {
  thesis::enable();
  return std::make_unique<SceneDemo>(scene, settings, camera_for(scene), 0);
}

// The camera and the ground lines are those of the original.
std::unique_ptr<Demo> make_boxes_and_balls(const Options& options) {
  Scene scene = scenes::make("boxes-and-balls", options.scene);
  scene.dt = options.dt.value_or(scene.dt);
  const Camera camera{.eye = {0, 10, 50}, .target = {0, 10, 0}};
  return std::make_unique<SceneDemo>(std::move(scene), options.world, camera, 67);
}

}  // namespace demos
}  // namespace JFPX_ABI
}  // namespace jfpx
