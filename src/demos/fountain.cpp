/// Demo fountain: a jet of balls, many of which are added and removed in every step.
#include <jfpx/error.hpp>
#include <jfpx/random.hpp>

#include "src/demos/makers.hpp"
#include "src/scenes/makers.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <deque>
#include <string>

namespace jfpx {
inline namespace JFPX_ABI {
namespace demos {
namespace {

/// Indices of the controls.
enum FountainControl : std::size_t { kJet, kResetFountain };
constexpr std::array<Control, 2> kFountainControls{
    {{"jet", "switch the jet off and on", "1"}, {"reset", "restart", "r"}}};

constexpr std::uint32_t kDefaultBalls = 18000;
constexpr double kLifetime = 3;        // [s] of a ball
constexpr Real kRadius = Real(0.05);   // [m] of a ball
constexpr Real kSpacing = Real(0.11);  // [m], between the sites of the nozzle
constexpr Real kSpeed = 9;             // [m/s], upward; a ball moves 0.15 m in 1/60 s
constexpr Real kRim = Real(0.6);       // [m], height of the basin

/// Number of sites along an edge of the nozzle. Each site emits at most 60 balls per second, so
/// that successive balls do not overlap.
Real nozzle_side(std::uint32_t balls) {
  return std::max(Real(1), std::ceil(square_root(static_cast<Real>(balls) / Real(60 * kLifetime))));
}

class Fountain final : public Demo {
 public:
  explicit Fountain(const Options& options)
      : Demo(kFountainControls),
        options_(options),
        balls_(options.scene.spheres.value_or(kDefaultBalls)),
        side_(nozzle_side(balls_)),
        random_(options.scene.seed),
        scene_(basin()),
        world_(scene_, options.world) {
    if (options.scene.boxes) {
      throw InvalidArgument("boxes is " + std::to_string(*options.scene.boxes) +
                            "; it must be absent, because \"fountain\" has no boxes");
    }
  }

  std::string_view name() const override { return "fountain"; }
  Real dt() const override { return scene_.dt; }
  std::vector<BodyState> states() const override { return world_.states(); }
  const World* world() const override { return &world_; }
  const Scene* scene() const override { return &scene_; }
  void draw(View* view) const override;

 private:
  struct Ball {
    BodyId id;
    std::uint64_t step;  ///< World::steps() at the addition
  };

  Scene basin() const {
    Scene scene;
    scene.name = "fountain";
    scene.dt = options_.dt.value_or(scene.dt);
    const Real half = side_ * kSpacing * Real(0.5) + 4;
    scenes::add_container(scene, {-half, 0, -half}, {half, kRim, half}, false, BodyDef{});
    return scene;
  }
  void act(std::size_t control) override {
    if (control == kJet) {
      flows_ = !flows_;
      return;
    }
    random_ = Random(options_.scene.seed);
    world_ = World(scene_, options_.world);
    alive_.clear();
    flows_ = true;
    flow_steps_ = emitted_ = 0;
  }
  StepReport advance() override;
  void emit(Real delay);

  Options options_;
  std::uint32_t balls_;  ///< in the world after kLifetime
  Real side_;            ///< sites along an edge of the nozzle
  Random random_;
  Scene scene_;  ///< the basin
  World world_;
  bool flows_ = true;
  std::uint64_t flow_steps_ = 0;  ///< in which the jet was on
  std::uint64_t emitted_ = 0;
  std::deque<Ball> alive_;  ///< oldest first
};

/// Adds a ball at the next site of the nozzle.
/// @param delay [s], between the emission and the beginning of the step
void Fountain::emit(Real delay) {
  const auto side = static_cast<std::uint64_t>(side_);
  const std::uint64_t site = emitted_++ % (side * side);
  const std::uint64_t column = site % side, row = site / side;
  const Real middle = (side_ - 1) * Real(0.5);
  const Real x = static_cast<Real>(column) - middle;
  const Real z = static_cast<Real>(row) - middle;
  BodyDef ball =
      scenes::sphere_at({x * kSpacing, kRim + kSpeed * delay, z * kSpacing}, kRadius, Real(0.5));
  // The jet diverges by a tenth of the speed at the edge of the nozzle.
  const Real spread = kSpeed * Real(0.2) / side_;
  const Vec3 jitter = random_.uniform_in_box({-1, -1, -1}, {1, 1, 1}) * Real(0.3);
  ball.velocity = Vec3{x * spread, kSpeed, z * spread} + jitter;
  ball.restitution = Real(0.3);
  alive_.push_back({world_.add(ball), world_.steps()});
}

/// The numbers of balls depend only on the numbers of steps.
StepReport Fountain::advance() {
  const auto lifetime = static_cast<std::uint64_t>(std::ceil(kLifetime / dt() - 0.5));
  while (!alive_.empty() && world_.steps() - alive_.front().step >= lifetime) {
    world_.remove(alive_.front().id);
    alive_.pop_front();
  }
  if (flows_) {
    const double rate = balls_ / kLifetime, flown = static_cast<double>(++flow_steps_) * dt();
    const auto due = static_cast<std::uint64_t>(std::floor(flown * rate + 0.5));
    while (emitted_ < due) emit(static_cast<Real>(static_cast<double>(due - emitted_ - 1) / rate));
  }
  return world_.step();
}

void Fountain::draw(View* view) const {
  *view = {};
  const Real distance = side_ * kSpacing + 11;
  view->camera.eye = {distance * Real(0.35), distance * Real(0.6), distance * Real(0.8)};
  view->camera.target = {0, Real(1.5), 0};
  for (const BodyDef& wall : scene_.bodies) {
    view->items.push_back({.shape = wall.shape, .position = wall.position, .colour = kGrey});
  }
  for (const Ball& ball : alive_) {
    view->items.push_back({.shape = Sphere{kRadius},
                           .position = world_.state(ball.id).position,
                           .colour = {0.30F, 0.55F, 0.80F}});
  }
  view->text = {std::to_string(alive_.size()) + " balls, " + std::to_string(emitted_) +
                " so far, each for three seconds"};
}

}  // namespace

std::unique_ptr<Demo> make_fountain(const Options& options) {
  return std::make_unique<Fountain>(options);
}

}  // namespace demos
}  // namespace JFPX_ABI
}  // namespace jfpx
