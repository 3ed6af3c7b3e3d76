/// Tests of the validation of scenes, with one fault at a time.
#include "src/scene/scene_validate.hpp"

#include <jfpx/error.hpp>

#include "tests/world/support.hpp"

#include <gtest/gtest.h>

#include <functional>
#include <limits>

namespace jfpx {
namespace {

using test::operator""_r;

constexpr Real kNan = std::numeric_limits<Real>::quiet_NaN();
constexpr Real kInfinity = std::numeric_limits<Real>::infinity();
constexpr Real kDenormal = std::numeric_limits<Real>::denorm_min();

Scene valid_scene() {
  Scene scene;
  scene.bodies.resize(4);
  scene.bodies[1].shape = Box{};
  scene.bodies[2].shape = HalfSpace{};
  scene.bodies[2].mass = 0;
  scene.bodies.resize(6);
  scene.bodies[4].shape = Plane{};
  scene.bodies[4].mass = 0;
  scene.bodies[5].shape = Compound{{{.shape = Sphere{}, .position = {-1, 0, 0}},
                                    {.shape = Sphere{}, .position = {1, 0, 0}},
                                    {.shape = Box{}}}};
  return scene;
}

/// The message of the error, or "" if there is none.
std::string message(const Scene& scene) {
  try {
    validate(scene);
  } catch (const InvalidScene& error) {
    return error.what();
  }
  return "";
}

TEST(Validate, AValidSceneAndAnEmptyOnePass) {
  EXPECT_EQ(message(valid_scene()), "");
  EXPECT_EQ(message(Scene{}), "");
}

TEST(Validate, TheLimitsOfTheRangesPass) {
  Scene scene = valid_scene();
  scene.dt = std::numeric_limits<Real>::min();
  scene.resolver = {.max_iterations = 0xffffffffu,
                    .velocity_epsilon = kDenormal,
                    .position_epsilon = kDenormal,
                    .restitution_velocity = 0,
                    .angular_limit = 1};
  scene.soft_step = {.substeps = 1,
                     .contact_hertz = std::numeric_limits<Real>::max(),
                     .damping_ratio = 0.01_r,
                     .push_out_speed = kDenormal,
                     .restitution_threshold = 0,
                     .speculative_margin = kMaxCoordinate};
  scene.sleep = {.enabled = false, .speed = 0, .time = 0, .epsilon = kDenormal, .bias = 1};
  BodyDef& def = scene.bodies[3];
  def.shape = Sphere{kMaxCoordinate};
  def.position = {kMaxCoordinate, -kMaxCoordinate, 0};
  def.velocity.x = std::numeric_limits<Real>::max();
  def.linear_damping = def.angular_damping = kDenormal;
  def.friction = std::numeric_limits<Real>::max();
  def.rolling_friction = def.spinning_friction = std::numeric_limits<Real>::max();
  def.restitution = 1;
  def.orientation = {0.707_r, 0.707_r, 0, 0};
  EXPECT_EQ(message(scene), "");
  scene.soft_step = {.substeps = 64,
                     .contact_hertz = 0,
                     .damping_ratio = 1000,
                     .push_out_speed = std::numeric_limits<Real>::max(),
                     .restitution_threshold = std::numeric_limits<Real>::max(),
                     .speculative_margin = 0};
  scene.sleep.speed = scene.sleep.time = std::numeric_limits<Real>::max();
  EXPECT_EQ(message(scene), "");
}

TEST(Validate, MessagesNameBodyFieldValueAndRange) {
  Scene scene = valid_scene();
  scene.bodies[3].mass = -1;
  EXPECT_EQ(message(scene), "body 3: mass is -1; it must be finite and >= 0");
  scene = valid_scene();
  scene.bodies[1].velocity = {0.5_r, kNan, -2};
  EXPECT_EQ(message(scene), "body 1: velocity is (0.5, nan, -2); it must be finite");
  scene = valid_scene();
  scene.dt = 0;
  EXPECT_EQ(message(scene), "scene: dt is 0; it must be finite, > 0 and not denormal");
  scene = valid_scene();
  scene.bodies[0].shape = Sphere{0};
  scene.bodies[1].mass = kInfinity;
  EXPECT_EQ(message(scene), "body 0: radius is 0; it must be > 0 and at most 1e9");
}

TEST(Validate, MotionLocksNeedTheSoftStep) {
  Scene scene = valid_scene();
  scene.bodies[1].motion_locks.angular_y = true;
  scene.solver = Solver::worst_first;
  EXPECT_EQ(message(scene),
            "body 1: solver is worst_first; it must be soft_step for a body with motion_locks");
  scene.solver = Solver::soft_step;
  EXPECT_EQ(message(scene), "");
}

struct Fault {
  const char* field;
  std::function<void(Scene&, Real)> put;
  std::vector<Real> values;
};

TEST(Validate, EveryFieldIsChecked) {
  const auto body = [](auto member) {
    return [member](Scene& scene, Real value) { scene.bodies[0].*member = value; };
  };
  const auto part = [](Scene& scene, std::size_t i) -> CompoundPart& {
    return std::get<Compound>(scene.bodies[5].shape).parts[i];
  };
  const std::vector<Real> not_finite = {kNan, kInfinity, -kInfinity};
  const auto and_also = [&](std::vector<Real> values) {
    values.insert(values.end(), not_finite.begin(), not_finite.end());
    return values;
  };
  const std::vector<Fault> faults = {
      {"dt", [](Scene& s, Real v) { s.dt = v; }, and_also({0, -1, kDenormal})},
      {"soft_step.contact_hertz", [](Scene& s, Real v) { s.soft_step.contact_hertz = v; },
       and_also({-1})},
      {"soft_step.damping_ratio", [](Scene& s, Real v) { s.soft_step.damping_ratio = v; },
       and_also({0, 0.009_r, 1001, -1})},
      {"soft_step.push_out_speed", [](Scene& s, Real v) { s.soft_step.push_out_speed = v; },
       and_also({0, -1})},
      {"soft_step.restitution_threshold",
       [](Scene& s, Real v) { s.soft_step.restitution_threshold = v; }, and_also({-1})},
      {"soft_step.speculative_margin", [](Scene& s, Real v) { s.soft_step.speculative_margin = v; },
       and_also({-1, 1.01e9_r})},
      {"resolver.velocity_epsilon", [](Scene& s, Real v) { s.resolver.velocity_epsilon = v; },
       and_also({0, -1})},
      {"resolver.position_epsilon", [](Scene& s, Real v) { s.resolver.position_epsilon = v; },
       and_also({0, -1})},
      {"resolver.restitution_velocity",
       [](Scene& s, Real v) { s.resolver.restitution_velocity = v; }, and_also({-1})},
      {"resolver.angular_limit", [](Scene& s, Real v) { s.resolver.angular_limit = v; },
       and_also({0, -1, 1.01_r})},
      {"sleep.speed", [](Scene& s, Real v) { s.sleep.speed = v; }, and_also({-1})},
      {"sleep.time", [](Scene& s, Real v) { s.sleep.time = v; }, and_also({-1})},
      {"sleep.epsilon", [](Scene& s, Real v) { s.sleep.epsilon = v; }, and_also({0, -1})},
      {"sleep.bias", [](Scene& s, Real v) { s.sleep.bias = v; }, and_also({0, -1, 1.01_r})},
      {"mass", body(&BodyDef::mass), and_also({-1, kDenormal})},
      {"linear_damping", body(&BodyDef::linear_damping), and_also({0, -1, 1.01_r})},
      {"angular_damping", body(&BodyDef::angular_damping), and_also({0, -1, 1.01_r})},
      {"friction", body(&BodyDef::friction), and_also({-1})},
      {"restitution", body(&BodyDef::restitution), and_also({-1, 1.01_r})},
      {"rolling_friction", body(&BodyDef::rolling_friction), and_also({-1})},
      {"spinning_friction", body(&BodyDef::spinning_friction), and_also({-1})},
      {"radius", [](Scene& s, Real v) { s.bodies[0].shape = Sphere{v}; },
       and_also({0, -1, 1.01e9_r})},
      {"half_extents",
       [](Scene& s, Real v) {
         s.bodies[0].shape = Box{{1, v, 1}};
       },
       and_also({0, -1, 1.01e9_r})},
      {"normal",
       [](Scene& s, Real v) {
         s.bodies[2].shape = HalfSpace{{0, v, 0}, 0};
       },
       and_also({0, 0.99_r, 1.01_r})},
      {"offset",
       [](Scene& s, Real v) {
         s.bodies[2].shape = HalfSpace{{0, 1, 0}, v};
       },
       and_also({1.01e9_r, -1.01e9_r})},
      {"normal",
       [](Scene& s, Real v) {
         s.bodies[4].shape = Plane{{0, v, 0}, 0};
       },
       and_also({0, 0.99_r, 1.01_r})},
      {"offset",
       [](Scene& s, Real v) {
         s.bodies[4].shape = Plane{{0, 1, 0}, v};
       },
       and_also({1.01e9_r, -1.01e9_r})},
      {"parts[1].radius", [part](Scene& s, Real v) { part(s, 1).shape = Sphere{v}; },
       and_also({0, -1, 1.01e9_r})},
      {"parts[2].half_extents",
       [part](Scene& s, Real v) {
         part(s, 2).shape = Box{{1, 1, v}};
       },
       and_also({0, -1, 1.01e9_r})},
      {"parts[0].position", [part](Scene& s, Real v) { part(s, 0).position.y = v; },
       and_also({1.01e9_r, -1.01e9_r})},
      {"parts[0].orientation",
       [part](Scene& s, Real v) {
         part(s, 0).orientation = {0, v, 0, 0};
       },
       and_also({0, 0.99_r, 1.01_r})},
      {"parts[2].density", [part](Scene& s, Real v) { part(s, 2).density = v; },
       and_also({0, -1, 1.01e9_r})},
      {"position", [](Scene& s, Real v) { s.bodies[0].position.z = v; },
       and_also({1.01e9_r, -1.01e9_r})},
      {"orientation",
       [](Scene& s, Real v) {
         s.bodies[0].orientation = {v, 0, 0, 0};
       },
       and_also({0, 0.99_r, 1.01_r})},
      {"velocity", [](Scene& s, Real v) { s.bodies[0].velocity.x = v; }, not_finite},
      {"angular_velocity", [](Scene& s, Real v) { s.bodies[0].angular_velocity.y = v; },
       not_finite},
      {"acceleration", [](Scene& s, Real v) { s.bodies[0].acceleration.z = v; }, not_finite},
  };
  for (const Fault& fault : faults) {
    for (const Real value : fault.values) {
      Scene scene = valid_scene();
      fault.put(scene, value);
      const std::string text = message(scene);
      EXPECT_NE(text.find(std::string(": ") + fault.field + " is "), std::string::npos)
          << fault.field << " = " << value << ": \"" << text << '"';
    }
  }
}

TEST(Validate, AnInvalidRuleIsRefused) {
  Scene scene = valid_scene();
  scene.materials.restitution = static_cast<CombineRule>(5);
  EXPECT_EQ(message(scene),
            "scene: materials.restitution is 5; it must be one of the rules of CombineRule");
}

TEST(Validate, ASolverIsOneOfTheEnumeration) {
  Scene scene = valid_scene();
  for (const Solver solver : test::kSolvers) {
    scene.solver = solver;
    EXPECT_EQ(message(scene), "");
  }
  scene.solver = static_cast<Solver>(2);
  EXPECT_EQ(message(scene), "scene: solver is 2; it must be one of the values of Solver");
}

TEST(Validate, AStepHasOneTo64Substeps) {
  Scene scene = valid_scene();
  for (const std::uint32_t substeps : {0u, 65u, 0xffffffffu}) {
    scene.soft_step.substeps = substeps;
    EXPECT_NE(message(scene).find("scene: soft_step.substeps is "), std::string::npos);
    EXPECT_NE(message(scene).find("; it must be from 1 to 64"), std::string::npos);
  }
}

TEST(Validate, AnIgnoredPairIsOfTwoDifferentBodiesOfTheScene) {
  Scene scene = valid_scene();
  scene.ignored_pairs = {{0, 5}, {5, 0}, {0, 5}};
  EXPECT_EQ(message(scene), "");
  scene.ignored_pairs = {{0, 5}, {3, 3}};
  EXPECT_EQ(message(scene),
            "scene: ignored_pairs[1] is (3, 3); it must be two different indices of the scene's 6 "
            "bodies");
  scene.ignored_pairs = {{0, 6}};
  EXPECT_EQ(message(scene),
            "scene: ignored_pairs[0] is (0, 6); it must be two different indices of the scene's 6 "
            "bodies");
  scene.ignored_pairs = {{0xffffffffu, 0}};
  EXPECT_NE(message(scene), "");
}

TEST(Validate, AKinematicBodyHasZeroMassAndAPose) {
  Scene scene = valid_scene();
  scene.bodies[0].kinematic = true;
  EXPECT_EQ(message(scene), "body 0: mass is 1; it must be 0 for a kinematic body");
  scene.bodies[0].mass = 0;
  EXPECT_EQ(message(scene), "");
  scene.bodies[2].kinematic = true;
  EXPECT_EQ(message(scene),
            "body 2: kinematic is true; it must be false for a half-space, which follows no pose");
  scene.bodies[2].shape = Plane{{0, 1, 0}, 0};
  EXPECT_EQ(message(scene),
            "body 2: kinematic is true; it must be false for a plane, which follows no pose");
}

TEST(Validate, AHalfSpaceAndAPlaneHaveZeroMass) {
  Scene scene = valid_scene();
  scene.bodies[2].mass = 1;
  EXPECT_EQ(message(scene),
            "body 2: mass is 1; it must be 0 for a half-space, which fills half of the world");
  scene.bodies[2].shape = Plane{{0, 1, 0}, 0};
  EXPECT_EQ(message(scene),
            "body 2: mass is 1; it must be 0 for a plane, which divides the whole world");
}

TEST(Validate, AnInertiaMustBeValid) {
  const auto complaint = [](const Mat3& inertia) {
    Scene scene = valid_scene();
    scene.bodies[1].inertia = inertia;
    return message(scene);
  };
  EXPECT_EQ(complaint(diagonal({1, 2, 3})), "");
  EXPECT_EQ(complaint(diagonal({1, -2, 3})),
            "body 1: inertia is ((1, 0, 0), (0, -2, 0), (0, 0, 3)); it must be positive definite");
  EXPECT_NE(complaint(diagonal({1, 0, 1})), "");
  EXPECT_NE(complaint(diagonal({0, 0, 0})), "");
  EXPECT_NE(complaint(diagonal({1, kNan, 1})), "");
  EXPECT_NE(complaint(diagonal({1, 1, kInfinity})), "");
  EXPECT_NE(complaint(diagonal({1, 1, 2.1_r})), "");
  EXPECT_NE(complaint(Mat3{{{1, 0.1_r, 0}, {0, 1, 0}, {0, 0, 1}}}), "");
  // A given inertia makes a body valid whose shape alone would have no finite inertia.
  Scene scene = valid_scene();
  scene.bodies[0].mass = std::numeric_limits<Real>::min();
  scene.bodies[0].shape = Sphere{square_root(std::numeric_limits<Real>::min())};
  scene.bodies[0].inertia = Mat3{};
  EXPECT_EQ(message(scene), "");
}

TEST(Validate, MassesWithoutFiniteInertiaAreRefused) {
  const Real tiny = square_root(std::numeric_limits<Real>::min());
  Scene scene = valid_scene();
  scene.bodies[0].mass = std::numeric_limits<Real>::min();
  scene.bodies[0].shape = Sphere{tiny};
  EXPECT_NE(message(scene).find("body 0: moment of inertia is "), std::string::npos);
  scene.bodies[0].shape = Box{{tiny, tiny, tiny}};
  EXPECT_NE(message(scene).find("body 0: moments of inertia is "), std::string::npos);
  scene.bodies[0].mass = 0;
  EXPECT_EQ(message(scene), "");
}

TEST(Validate, ACompoundNeedsPartsAroundItsCentreOfMass) {
  Scene scene = valid_scene();
  scene.bodies[5].shape = Compound{};
  EXPECT_EQ(message(scene), "body 5: parts is empty; it must have at least one solid");
  scene = valid_scene();
  auto& compound = std::get<Compound>(scene.bodies[5].shape);
  for (CompoundPart& part : compound.parts) part.position.y += 0.5_r;
  EXPECT_EQ(message(scene),
            "body 5: centre of mass of parts is (0, 0.5, 0); it must be the origin, to a "
            "thousandth of the body's radius; centred() moves it there");
  scene.bodies[5].mass = 0;  // an immovable body has no centre of mass
  EXPECT_EQ(message(scene), "");
  scene.bodies[5].mass = 1;
  scene.bodies[5].shape = centred(compound);
  EXPECT_EQ(message(scene), "");
}

TEST(Validate, ACompoundWithoutFiniteInertiaIsRefused) {
  const Real tiny = square_root(std::numeric_limits<Real>::min());
  Scene scene = valid_scene();
  scene.bodies[5].mass = std::numeric_limits<Real>::min();
  scene.bodies[5].shape = Compound{{{.shape = Sphere{tiny}}}};
  EXPECT_NE(message(scene).find("body 5: moments of inertia is "), std::string::npos);
}

TEST(Validate, MoreBodiesThanIndicesAreRefused) {
  EXPECT_NO_THROW(validate_body_count(0xffffffffu));
  EXPECT_THROW(validate_body_count(0x100000000u), InvalidScene);
}

TEST(Validate, AWorldRefusesAnInvalidSceneAndAnInvalidBody) {
  Scene scene;
  scene.bodies = {test::ball({kNan, 0, 0})};
  EXPECT_THROW(World{scene}, InvalidScene);
  World world{Scene{}};
  EXPECT_THROW(world.add(scene.bodies[0]), InvalidScene);
  EXPECT_TRUE(world.bodies().empty());
}

TEST(ToText, IsShortAndReadsBack) {
  EXPECT_EQ(to_text(0.1_r), "0.1");
  EXPECT_EQ(to_text(Real(-2)), "-2");
  EXPECT_EQ(to_text(kInfinity), "inf");
  EXPECT_EQ(to_text(Vec3{1, 2, 3}), "(1, 2, 3)");
  EXPECT_EQ(to_text(Quat{}), "(1, 0, 0, 0)");
}

}  // namespace
}  // namespace jfpx
