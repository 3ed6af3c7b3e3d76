/// Demo flight: an aircraft accelerates along the ground and takes off (thesis 4.4.3), based on
/// Millington's demo of the same name.
#include "src/demos/makers.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

namespace jfpx {
inline namespace JFPX_ABI {
namespace demos {
namespace {

// The aircraft flies towards -x, so +z is to the left of the pilot.
enum ControlId : std::size_t {
  kYawRight,
  kYawLeft,
  kPitchDown,
  kPitchUp,
  kRollRight,
  kRollLeft,
  kLevel,
  kReset
};
constexpr Control kControls[] = {
    {"yaw-right", "turn the rudder to the right", "q", true},
    {"yaw-left", "turn the rudder to the left", "e", true},
    {"pitch-down", "lower both wings", "w", true},
    {"pitch-up", "raise both wings", "s", true},
    {"roll-right", "raise the left wing and lower the right wing", "d", true},
    {"roll-left", "lower the left wing and raise the right wing", "a", true},
    {"level", "center all control surfaces", "x"},
    {"reset", "restart at rest", "r"},
};
constexpr Real kDeflectionPerStep = Real(0.1);  ///< [-], of a surface while its key is down
constexpr Real kCrashSpeed = 10;                ///< [m/s], downward speed at the ground

enum Surface : std::size_t { kWingMinusZ, kWingPlusZ, kRudder, kSurfaces };

Mat3 lift_tensor(Real yx) {
  Mat3 tensor = diagonal({0, Real(-0.5), 0});
  tensor(1, 0) = yx;
  return tensor;
}
Mat3 rudder_tensor(Real zx) {
  Mat3 tensor = diagonal({});
  tensor(2, 0) = zx;
  return tensor;
}
Mat3 tail_tensor() {
  Mat3 tensor = diagonal({0, Real(-0.5), Real(-0.1)});
  tensor(1, 0) = -1;
  return tensor;
}
AeroControl wing(BodyId body, Real z) {
  return {.body = body,
          .lowest = lift_tensor(Real(-0.995)),
          .base = lift_tensor(-1),
          .highest = lift_tensor(Real(-1.005)),
          .point = {-1, 0, z}};
}

/// The numbers of the thesis, but with the inertia that corresponds to the mass (errata E22, E23)
/// and with damping once per step (E18). The ground is not a body: see keep_above_ground().
Scene flight_scene(Real dt) {
  BodyDef aircraft;
  aircraft.shape = Box{{2, 1, 1}};
  aircraft.mass = Real(2.5);
  aircraft.linear_damping = aircraft.angular_damping = Real(0.8);
  aircraft.can_sleep = false;
  Scene scene;
  scene.name = "flight";
  scene.solver = Solver::worst_first;
  scene.dt = dt;
  scene.bodies = {aircraft};
  return scene;
}

/// A force of 10 N in the direction of the nose.
struct Propulsion {
  BodyId body;
  void operator()(ForceContext& context) const {
    context.apply_force(body, rotate(context.state(body).orientation, {-10, 0, 0}));
  }
};

/// A box of the picture.
struct Part {
  Vec3 size, position;  ///< [m], body axes
  Colour colour;
};
constexpr Colour kBlue{0.12F, 0.30F, 0.62F}, kIvory{0.90F, 0.88F, 0.82F};
constexpr Part kParts[] = {{{2, Real(0.8), 1}, {Real(-0.5), 0, 0}, kBlue},
                           {{Real(2.75), Real(0.5), Real(0.5)}, {1, Real(0.15), 0}, kBlue},
                           {{Real(0.8), Real(0.1), 6}, {0, Real(0.3), 0}, kIvory},
                           {{Real(0.75), Real(1.15), Real(0.1)}, {2, Real(0.775), 0}, kBlue},
                           {{Real(0.85), Real(0.1), 2}, {Real(1.9), 0, 0}, kIvory}};

class Flight final : public Demo {
 public:
  explicit Flight(const Options& options)
      : Demo(kControls),
        scene_(flight_scene(options.dt.value_or(Real(1) / Real(60)))),
        world_(scene_, options.world) {
    add_forces();
  }

  std::string_view name() const override { return "flight"; }
  Real dt() const override { return scene_.dt; }
  std::vector<BodyState> states() const override { return world_.states(); }
  const World* world() const override { return &world_; }
  const Scene* scene() const override { return &scene_; }
  void draw(View* view) const override;

 private:
  BodyId aircraft() const { return world_.bodies().front(); }
  void add_forces();
  void reset();
  void deflect(Surface surface, Real change);
  void level();
  void act(std::size_t control) override;
  StepReport advance() override;
  void keep_above_ground();

  Scene scene_;
  World world_;
  std::array<ForceId, kSurfaces> surfaces_;
  std::array<Real, kSurfaces> control_{};  ///< [-], deflections in [-1, 1]
};

void Flight::add_forces() {
  const BodyId body = aircraft();
  world_.add_force(Propulsion{body});
  surfaces_[kWingMinusZ] = world_.add_force(wing(body, -2));
  surfaces_[kWingPlusZ] = world_.add_force(wing(body, 2));
  surfaces_[kRudder] = world_.add_force(AeroControl{.body = body,
                                                    .lowest = rudder_tensor(Real(0.01)),
                                                    .base = rudder_tensor(0),
                                                    .highest = rudder_tensor(Real(-0.01)),
                                                    .point = {2, Real(0.5), 0}});
  world_.add_force(Aero{.body = body, .tensor = tail_tensor(), .point = {2, 0, 0}});
}

void Flight::reset() {
  world_.set_state(aircraft(), {});
  level();
}

void Flight::deflect(Surface surface, Real change) {
  control_[surface] = std::clamp(control_[surface] + change, Real(-1), Real(1));
  world_.force<AeroControl>(surfaces_[surface]).control = control_[surface];
}

void Flight::level() {
  for (const Surface surface : {kWingMinusZ, kWingPlusZ, kRudder}) {
    deflect(surface, -control_[surface]);
  }
}

void Flight::act(std::size_t control) {
  switch (control) {
    case kYawRight:
      deflect(kRudder, kDeflectionPerStep);
      break;
    case kYawLeft:
      deflect(kRudder, -kDeflectionPerStep);
      break;
    case kPitchDown:
    case kPitchUp:
      for (const Surface side : {kWingMinusZ, kWingPlusZ}) {
        deflect(side, control == kPitchUp ? kDeflectionPerStep : -kDeflectionPerStep);
      }
      break;
    case kRollRight:
    case kRollLeft: {
      const Real left = control == kRollRight ? kDeflectionPerStep : -kDeflectionPerStep;
      deflect(kWingPlusZ, left);
      deflect(kWingMinusZ, -left);
      break;
    }
    case kLevel:
      level();
      break;
    case kReset:
      reset();
      break;
  }
}

StepReport Flight::advance() {
  StepReport report = world_.step();
  keep_above_ground();
  return report;
}

/// The ground is a lower limit of the height of the centre of mass, as in the original, but also
/// stops its downward velocity (erratum E22). An aircraft that descends too fast is reset.
void Flight::keep_above_ground() {
  BodyState state = world_.state(aircraft());
  if (state.position.y >= 0) return;
  if (state.velocity.y < -kCrashSpeed) {
    reset();
    return;
  }
  state.position.y = 0;
  state.velocity.y = std::max(state.velocity.y, Real(0));
  world_.set_state(aircraft(), state);
}

void Flight::draw(View* view) const {
  *view = {};
  const BodyState state = world_.state(aircraft());
  const Real speed = length(state.velocity);
  const Vec3 behind = rotate(state.orientation, {4 + speed, 0, 0});
  view->camera.eye = state.position + Vec3{behind.x, 5, behind.z};
  view->camera.target = state.position;
  // Small squares on the ground, one metre apart, make the speed visible.
  const Real x = std::round(state.position.x), z = std::round(state.position.z);
  for (int i = -20; i <= 20; ++i) {
    for (int j = -20; j <= 20; ++j) {
      view->items.push_back({.shape = Box{{Real(0.1), Real(0.001), Real(0.1)}},
                             .position = {x + static_cast<Real>(i), 0, z + static_cast<Real>(j)},
                             .colour = kGrey});
    }
  }
  for (const Part& part : kParts) {
    const Item item{.shape = Box{part.size * Real(0.5)},
                    .position = state.position + rotate(state.orientation, part.position),
                    .orientation = state.orientation,
                    .colour = part.colour};
    view->items.push_back(shadow_of(item, Real(0.001)));
    view->items.push_back(item);
  }
  const auto control = [this](Surface surface) { return static_cast<double>(control_[surface]); };
  char state_line[80], control_line[80];
  std::snprintf(state_line, sizeof state_line, "altitude %.1f m, speed %.1f m/s",
                static_cast<double>(state.position.y), static_cast<double>(speed));
  std::snprintf(control_line, sizeof control_line, "wings: left %+.1f, right %+.1f; rudder %+.1f",
                control(kWingPlusZ), control(kWingMinusZ), control(kRudder));
  view->text = {state_line, control_line};
}

}  // namespace

std::unique_ptr<Demo> make_flight(const Options& options) {
  return std::make_unique<Flight>(options);
}

}  // namespace demos
}  // namespace JFPX_ABI
}  // namespace jfpx
