/// Demo ballistic: four weapons fire particles along a range (thesis 3.7), based on Millington's
/// demo of the same name.
#include <jfpx/thesis/particle.hpp>

#include "src/demos/gunnery.hpp"

#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace demos {
namespace {

constexpr Vec3 kGun{0, Real(1.5), 0};

ParticleDef round_of(Weapon weapon) {
  ParticleDef round;
  round.position = kGun;
  round.damping = Real(0.99);
  switch (weapon) {
    case Weapon::pistol:
      round.mass = 2;
      round.velocity = {0, 0, 35};
      round.acceleration = {0, -1, 0};
      break;
    case Weapon::artillery:
      round.mass = 200;
      round.velocity = {0, 30, 40};
      round.acceleration = {0, -20, 0};
      break;
    case Weapon::fireball:
      round.mass = 1;
      round.velocity = {0, 0, 10};
      round.acceleration = {0, Real(0.6), 0};
      round.damping = Real(0.9);
      break;
    case Weapon::laser:
      round.mass = Real(0.1);
      round.velocity = {0, 0, 100};
      round.acceleration = {};
      break;
  }
  return round;
}

class Ballistic final : public GunDemo {
 public:
  explicit Ballistic(const Options& options) {
    settings_.dt = options.dt.value_or(settings_.dt);
    settings_.collider = options.world.collider;
    world_ = ParticleWorld(settings_);
  }

  std::string_view name() const override { return "ballistic"; }
  Real dt() const override { return settings_.dt; }
  std::vector<BodyState> states() const override;
  void draw(View* view) const override;

 private:
  struct Round {
    ParticleId id;
    double fired;  ///< [s]
  };

  std::size_t rounds() const override { return rounds_.size(); }
  void restart() override {
    world_ = ParticleWorld(settings_);
    rounds_.clear();
  }
  void fire(Weapon weapon) override {
    rounds_.push_back({world_.add(round_of(weapon)), world_.time()});
  }
  StepReport advance() override;

  ParticleSettings settings_;
  ParticleWorld world_;
  std::vector<Round> rounds_;  ///< rounds in flight, oldest first
};

StepReport Ballistic::advance() {
  const ParticleReport particles = world_.step();
  std::erase_if(rounds_, [this](const Round& round) {
    const bool gone = spent(world_.state(round.id).position, world_.time() - round.fired);
    if (gone) world_.remove(round.id);
    return gone;
  });
  StepReport report;
  report.step = particles.step;
  report.contacts = particles.contacts;
  report.non_finite = particles.non_finite;
  report.non_finite_body = {particles.non_finite_particle.index,
                            particles.non_finite_particle.generation};
  report.awake = static_cast<std::uint32_t>(rounds_.size());
  return report;
}

std::vector<BodyState> Ballistic::states() const {
  std::vector<BodyState> states;
  for (const Round& round : rounds_) {
    const ParticleState state = world_.state(round.id);
    states.push_back({.position = state.position,
                      .orientation = {},
                      .velocity = state.velocity,
                      .angular_velocity = {}});
  }
  return states;
}

void Ballistic::draw(View* view) const {
  *view = {};
  view->camera.eye = {-15, 8, -15};
  view->camera.target = {0, 5, 22};
  draw_range(view, kGun);
  for (const Round& round : rounds_) {
    const Vec3 position = world_.state(round.id).position;
    const Item shadow{.shape = Sphere{Real(1.6)}, .position = position};
    view->items.push_back(shadow_of(shadow, Real(0.1)));
    view->items.push_back({.shape = Sphere{Real(1.3)}, .position = position, .colour = kBlack});
  }
  view->text = {gun_text()};
}

}  // namespace

std::unique_ptr<Demo> make_ballistic(const Options& options) {
  return std::make_unique<Ballistic>(options);
}

}  // namespace demos
}  // namespace JFPX_ABI
}  // namespace jfpx
