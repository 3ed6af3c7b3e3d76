/// Demo big-ballistic: the weapons of ballistic fire rigid balls at two crates (thesis 3.7), based
/// on Millington's demo of the same name.
#include "src/demos/gunnery.hpp"
#include "src/scenes/weapons.hpp"

#include <algorithm>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace demos {
namespace {

class BigBallistic final : public GunDemo {
 public:
  explicit BigBallistic(const Options& options)
      : settings_(options.world), scene_(make_scene(options)), world_(scene_, settings_) {}

  std::string_view name() const override { return "big-ballistic"; }
  Real dt() const override { return scene_.dt; }
  std::vector<BodyState> states() const override { return world_.states(); }
  const World* world() const override { return &world_; }
  const Scene* scene() const override { return &scene_; }
  void draw(View* view) const override;

 private:
  struct Round {
    BodyId id;
    Weapon weapon;
    double fired;  ///< [s]
  };

  static Scene make_scene(const Options& options) {
    Scene scene = scenes::make("big-ballistic", options.scene);
    scene.dt = options.dt.value_or(scene.dt);
    return scene;
  }
  std::size_t rounds() const override { return rounds_.size(); }
  void restart() override {
    world_ = World(scene_, settings_);
    rounds_.clear();
  }
  void fire(Weapon weapon) override {
    rounds_.push_back({world_.add(scenes::big_round(weapon)), weapon, world_.time()});
  }
  StepReport advance() override;
  bool is_crate(std::uint32_t body) const;
  bool hit_a_crate(BodyId round) const;

  WorldSettings settings_;
  Scene scene_;
  World world_;
  std::vector<Round> rounds_;  ///< rounds in flight, oldest first
};

/// The bodies of the scene have constant indices, because only rounds are added and removed.
bool BigBallistic::is_crate(std::uint32_t body) const {
  const std::vector<BodyDef>& bodies = scene_.bodies;
  return body < bodies.size() && std::holds_alternative<Box>(bodies[body].shape);
}

bool BigBallistic::hit_a_crate(BodyId round) const {
  const std::span<const Contact> contacts = world_.contacts();
  return std::any_of(contacts.begin(), contacts.end(), [&](const Contact& c) {
    return (c.a == round && is_crate(c.b.index)) || (c.b == round && is_crate(c.a.index));
  });
}

/// Removes a round after the step in which it hits a crate, so that its impulse has been applied.
/// Rounds collide with the ground and with each other; in the original they pass through both.
StepReport BigBallistic::advance() {
  StepReport report = world_.step();
  std::vector<BodyId> gone;  // collected first, because World::remove() clears the contacts
  for (const Round& round : rounds_) {
    const double age = world_.time() - round.fired;
    if (hit_a_crate(round.id) || spent(world_.state(round.id).position, age)) {
      gone.push_back(round.id);
    }
  }
  for (const BodyId id : gone) {
    world_.remove(id);
    std::erase_if(rounds_, [id](const Round& round) { return round.id == id; });
  }
  return report;
}

void BigBallistic::draw(View* view) const {
  *view = {};
  view->camera.eye = {0, 15, -30};
  view->camera.target = {0, 5, 22};
  draw_range(view, scenes::kBigGun);
  const auto add = [&](const Shape& shape, BodyId id, const Colour& colour) {
    const BodyState state = world_.state(id);
    const Item item{.shape = shape,
                    .position = state.position,
                    .orientation = state.orientation,
                    .colour = colour};
    view->items.push_back(shadow_of(item, Real(0.01)));
    view->items.push_back(item);
  };
  const std::vector<BodyDef>& bodies = scene_.bodies;
  for (const BodyId id : world_.bodies()) {
    if (id.index < bodies.size() && bodies[id.index].mass > 0) {
      add(bodies[id.index].shape, id, {0.75F, 0.55F, 0.3F});
    }
  }
  for (const Round& round : rounds_) add(scenes::big_round(round.weapon).shape, round.id, kBlack);
  view->text = {gun_text()};
}

}  // namespace

std::unique_ptr<Demo> make_big_ballistic(const Options& options) {
  return std::make_unique<BigBallistic>(options);
}

}  // namespace demos
}  // namespace JFPX_ABI
}  // namespace jfpx
