/// Tests of the named scenes and of the JSON form of scenes: round trips and every kind of error.
#include <jfpx/error.hpp>
#include <jfpx/recording.hpp>
#include <jfpx/scene.hpp>
#include <jfpx/world.hpp>

#include "src/scenes/scenes.hpp"
#include "tests/support/temporary_folder.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>

namespace jfpx {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

constexpr const char* kMinimal =
    R"({"jfpx_scene": 2, "bodies": [{"shape": {"type": "sphere", "radius": 1}}]})";

/// The message of the error that from_json() throws; empty if it throws none.
std::string complaint(std::string_view text) {
  try {
    from_json(text);
  } catch (const InvalidScene& error) {
    return error.what();
  }
  return {};
}

std::string with_body(const std::string& fields) {
  return R"({"jfpx_scene": 2, "bodies": [{"shape": {"type": "sphere", "radius": 1}, )" + fields +
         "}]}";
}

TEST(NamedScenes, AreValidAndRoundTripThroughJson) {
  for (const scenes::Entry& entry : scenes::all()) {
    for (const std::uint32_t spheres : {0u, 1u, 2u, 33u}) {
      const Scene scene = scenes::make(entry.name, {.spheres = spheres, .seed = 7});
      EXPECT_EQ(scene.name, entry.name);
      EXPECT_NO_THROW(validate(scene)) << entry.name;
      EXPECT_EQ(from_json(to_json(scene)), scene) << entry.name;
    }
    EXPECT_EQ(scenes::spheres_of(scenes::make(entry.name)).size(), entry.default_spheres);
  }
}

TEST(NamedScenes, DependOnTheSeedAndRepeat) {
  EXPECT_EQ(scenes::make("pile", {.seed = 3}), scenes::make("pile", {.seed = 3}));
  EXPECT_NE(scenes::make("pile", {.seed = 3}), scenes::make("pile", {.seed = 4}));
}

TEST(NamedScenes, TowerHasTheNumbersOfTheThesis) {
  const Scene scene = scenes::make("boxes-and-balls");
  ASSERT_EQ(scene.bodies.size(), 449u);
  const BodyDef& top = scene.bodies[447];
  EXPECT_NEAR(top.position.x, 134.2, 1e-4);
  EXPECT_EQ(top.position.y, 1342);
  EXPECT_EQ(top.mass, 20);
  EXPECT_EQ(top.acceleration, (Vec3{0, Real(-9.8), 0}));
  EXPECT_EQ(scene.dt, Real(0.01));
}

TEST(NamedScenes, TowerHasBoxesBesideItOnRequest) {
  const Scene without = scenes::make("boxes-and-balls", {.spheres = 5});
  const Scene scene = scenes::make("boxes-and-balls", {.spheres = 5, .boxes = 3});
  ASSERT_EQ(scene.bodies.size(), 9u);
  EXPECT_TRUE(std::equal(without.bodies.begin(), without.bodies.end(), scene.bodies.begin()));
  const BodyDef& top = scene.bodies.back();
  EXPECT_EQ(top.shape, Shape(Box{{1, 1, 1}}));
  EXPECT_EQ(top.position, (Vec3{0, 16, 3}));
  EXPECT_EQ(top.mass, 1);
  EXPECT_EQ(top.acceleration, (Vec3{0, Real(-9.81), 0}));
}

TEST(NamedScenes, MixedCountsItsBallsAndBoxes) {
  const auto boxes = [](const Scene& scene) {
    return std::ranges::count_if(scene.bodies, [](const BodyDef& body) {
      return std::holds_alternative<Box>(body.shape) && body.mass > 0;
    });
  };
  const Scene even = scenes::make("mixed", {.spheres = 40});
  EXPECT_EQ(even.bodies.size(), 40u + 40u + 5u);
  EXPECT_EQ(boxes(even), 40);
  const Scene odd = scenes::make("mixed", {.spheres = 3, .boxes = 10});
  EXPECT_EQ(scenes::spheres_of(odd).size(), 3u);
  EXPECT_EQ(boxes(odd), 10);
  EXPECT_EQ(boxes(scenes::make("mixed", {.spheres = 7, .boxes = 0})), 0);
  World world(even);  // no two bodies touch at the start
  EXPECT_EQ(world.step().contacts, 0u);
}

TEST(NamedScenes, ANumberOfBoxesIsRefusedByScenesWithoutBoxes) {
  EXPECT_THROW(scenes::make("pile", {.boxes = 3}), InvalidArgument);
  EXPECT_THROW(scenes::make("big-ballistic", {.boxes = 0}), InvalidArgument);
}

TEST(NamedScenes, CratesStandFaceToFaceAndTheVolleyTouchesNothing) {
  World world(scenes::make("big-ballistic", {.spheres = 9}));
  std::uint64_t crate_contacts = 0;
  world.step();
  for (const Contact& c : world.contacts()) {
    EXPECT_LT(c.a.index, 3u);  // crates are bodies 0 and 1, the ground is 2
    EXPECT_LT(c.b.index, 3u);
    EXPECT_NEAR(c.distance, 0, 0.003);  // one step of gravity
    ++crate_contacts;
  }
  EXPECT_EQ(crate_contacts, 4u + 4u + 4u);
}

TEST(NamedScenes, LatticeRoundsDownToACube) {
  EXPECT_EQ(scenes::make("lattice", {.spheres = 27}).bodies.size(), 27u);
  EXPECT_EQ(scenes::make("lattice", {.spheres = 63}).bodies.size(), 27u);
  EXPECT_EQ(scenes::make("lattice", {.spheres = 64}).bodies.size(), 64u);
}

TEST(NamedScenes, UnknownNameListsTheNames) {
  try {
    scenes::make("plie");
    FAIL();
  } catch (const InvalidArgument& error) {
    EXPECT_THAT(error.what(), HasSubstr("\"plie\""));
    EXPECT_THAT(error.what(), HasSubstr("pile"));
  }
}

TEST(NamedScenes, TooManySpheresAreRefusedBeforeAnyAllocation) {
  try {
    scenes::make("pile", {.spheres = 0xffffffffu});
    FAIL();
  } catch (const OutOfMemory& error) {
    EXPECT_THAT(error.what(), HasSubstr("4294967295 bodies needs about"));
  }
}

TEST(SceneJson, KeepsEveryBitOfEveryField) {
  Scene scene;
  scene.name = "a \"quoted\" name";
  scene.dt = Real(1) / Real(3);
  scene.solver = Solver::worst_first;
  scene.soft_step = {.substeps = 64,
                     .contact_hertz = Real(0.1),
                     .damping_ratio = Real(1) / Real(7),
                     .push_out_speed = std::numeric_limits<Real>::denorm_min(),
                     .restitution_threshold = Real(1e30),
                     .speculative_margin = Real(0.3)};
  scene.resolver.max_iterations = 17;
  scene.sleep = {.enabled = false, .speed = Real(0.7), .time = Real(1) / Real(3)};
  scene.materials = {CombineRule::maximum, CombineRule::average};
  BodyDef body;
  body.shape = Box{{Real(0.1), Real(1e-30), Real(1e8)}};
  body.mass = 0;
  body.position = {Real(0.1), std::numeric_limits<Real>::denorm_min(), Real(-1e9)};
  body.orientation = normalized(Quat{1, 2, 3, 4});
  body.velocity = {Real(-0.0), 1, 2};
  body.filter = {.category = 0xffffffffu, .mask = 0};
  scene.ignored_pairs = {{0, 1}, {4, 2}, {0, 1}};
  scene.bodies = {body, body, body, body, body};
  scene.bodies[4].kinematic = true;
  scene.bodies[2].sensor = true;
  scene.bodies[1].rolling_friction = Real(0.1);
  scene.bodies[2].spinning_friction = Real(1e-30);
  scene.bodies[3].user_data = 0xffffffffffffffffu;
  scene.bodies[4].inertia =
      Mat3{{{1, Real(0.1), Real(-0.2)}, {Real(0.1), 1, 0}, {Real(-0.2), 0, 1}}};
  scene.bodies[1].shape = HalfSpace{{0, 0, 1}, Real(-2.5)};
  scene.bodies[2].shape = Plane{{0, 1, 0}, Real(0.1)};
  scene.bodies[1].mass = scene.bodies[2].mass = 0;
  scene.bodies[3].shape =
      Compound{{{.shape = Sphere{Real(0.3)}, .position = {Real(0.1), 0, 7}, .density = Real(0.7)},
                {.shape = Box{}, .orientation = normalized(Quat{4, 3, 2, 1})}}};
  const Scene read = from_json(to_json(scene));
  EXPECT_EQ(read, scene);
  EXPECT_TRUE(std::signbit(read.bodies[0].velocity.x));
}

/// Files of version 0.1 name the shape "assembly".
TEST(SceneJson, TheOldNameOfACompoundIsRead) {
  const std::string with_old_name =
      R"({"jfpx_scene": 1, "bodies": [{"shape": {"type": "assembly", "parts": [)"
      R"({"shape": {"type": "box", "half_extents": [1, 2, 3]}}]}}]})";
  const Scene scene = from_json(with_old_name);
  EXPECT_EQ(scene.bodies.at(0).shape, Shape(Compound{{{.shape = Box{{1, 2, 3}}}}}));
  const std::string written = to_json(scene);
  EXPECT_THAT(written, HasSubstr("\"compound\""));
  EXPECT_THAT(written, Not(HasSubstr("assembly")));
  EXPECT_EQ(from_json(written), scene);
}

TEST(SceneJson, AbsentFieldsHaveDefaults) {
  const Scene scene = from_json(kMinimal);
  ASSERT_EQ(scene.bodies.size(), 1u);
  BodyDef expected;
  expected.shape = Sphere{1};
  EXPECT_EQ(scene.bodies[0], expected);
  EXPECT_EQ(scene.solver, Solver::soft_step);
  EXPECT_EQ(scene.soft_step, SoftStepSettings{});
  EXPECT_EQ(scene.sleep, SleepSettings{});
}

/// So that files of version 0.1 run as before.
TEST(SceneJson, AFileOfVersion1HasTheThesisResolver) {
  const Scene scene = from_json(R"({"jfpx_scene": 1, "bodies": []})");
  EXPECT_EQ(scene.solver, Solver::worst_first);
  const std::string written = to_json(scene);
  EXPECT_THAT(written, HasSubstr("{\"jfpx_scene\": 2,"));
  EXPECT_THAT(written, HasSubstr("\"solver\": \"worst_first\""));
  EXPECT_EQ(from_json(written), scene);
}

TEST(SceneJson, SolversAreNamed) {
  for (const Solver solver : {Solver::soft_step, Solver::worst_first}) {
    for (const char* version : {"1", "2"}) {
      const std::string text = R"({"jfpx_scene": )" + std::string(version) +
                               R"(, "bodies": [], "solver": ")" + to_string(solver) + R"("})";
      EXPECT_EQ(from_json(text).solver, solver);
    }
  }
  EXPECT_EQ(complaint(R"({"jfpx_scene": 2, "bodies": [], "solver": "fast"})"),
            "scene.solver: is \"fast\"; it must be one of soft_step, worst_first");
  EXPECT_EQ(complaint(R"({"jfpx_scene": 2, "bodies": [], "solver": 1})"),
            "scene.solver: is a number; it must be a string");
}

TEST(SceneJson, SettingsOfTheSoftStepMayBeGivenInPart) {
  const Scene scene = from_json(R"({"jfpx_scene": 2, "bodies": [], "soft_step": {"substeps": 8}})");
  EXPECT_EQ(scene.soft_step, SoftStepSettings{.substeps = 8});
  EXPECT_EQ(
      complaint(R"({"jfpx_scene": 2, "bodies": [], "soft_step": {"iterations": 8}})"),
      "scene.soft_step: has an unknown field \"iterations\"; known fields are "
      "contact_hertz, damping_ratio, push_out_speed, restitution_threshold, speculative_margin, "
      "substeps");
  EXPECT_EQ(complaint(R"({"jfpx_scene": 2, "bodies": [], "soft_step": {"substeps": 0.5}})"),
            "scene.soft_step.substeps: is 0.5; it must be a whole number from 0 to 4294967295");
  EXPECT_EQ(complaint(R"({"jfpx_scene": 2, "bodies": [], "soft_step": {"substeps": 65}})"),
            "scene: soft_step.substeps is 65; it must be from 1 to 64");
}

/// So that older versions read files without newer features.
TEST(SceneJson, NewerFieldsAreWrittenOnlyIfTheyAreNotTheDefault) {
  Scene scene = from_json(kMinimal);
  EXPECT_THAT(to_json(scene), Not(HasSubstr("filter")));
  EXPECT_THAT(to_json(scene), Not(HasSubstr("sensor")));
  EXPECT_THAT(to_json(scene), Not(HasSubstr("rolling_friction")));
  EXPECT_THAT(to_json(scene), Not(HasSubstr("spinning_friction")));
  EXPECT_THAT(to_json(scene), Not(HasSubstr("motion_locks")));
  EXPECT_THAT(to_json(scene), Not(HasSubstr("user_data")));
  EXPECT_THAT(to_json(scene), Not(HasSubstr("ignored_pairs")));
  scene.bodies.push_back(scene.bodies[0]);
  scene.bodies[1].filter.mask = 6;
  scene.bodies[1].sensor = true;
  scene.bodies[1].rolling_friction = Real(0.5);
  scene.bodies[1].spinning_friction = Real(0.25);
  scene.bodies[1].motion_locks = kPlanarMotion;
  scene.bodies[1].user_data = 9007199254740993u;
  scene.ignored_pairs = {{1, 0}};
  const std::string text = to_json(scene);
  EXPECT_THAT(text, HasSubstr("\"filter\":{\"category\":1,\"mask\":6}"));
  EXPECT_THAT(text, HasSubstr("\"sensor\":true"));
  EXPECT_THAT(text, HasSubstr("\"rolling_friction\":0.5"));
  EXPECT_THAT(text, HasSubstr("\"spinning_friction\":0.25"));
  EXPECT_THAT(text, HasSubstr("\"motion_locks\":{\"linear_z\":true,\"angular_x\":true,"
                              "\"angular_y\":true}"));
  EXPECT_THAT(text, HasSubstr("\"user_data\":9007199254740993"));
  EXPECT_THAT(text, HasSubstr("\"ignored_pairs\": [[1,0]]"));
  EXPECT_EQ(from_json(text), scene);
}

TEST(SceneJson, TheOrderOfFieldsIsFixed) {
  Scene scene;
  scene.dt = Real(0.5);
  BodyDef& body = scene.bodies.emplace_back();
  body.shape = Compound{{CompoundPart{.shape = Box{{1, 2, 3}}}}};
  body.inertia = Mat3{};
  body.filter.mask = 6;
  body.sensor = true;
  body.rolling_friction = body.spinning_friction = Real(0.5);
  body.acceleration = {};
  body.motion_locks.linear_y = true;
  body.user_data = 7;
  EXPECT_EQ(to_json(scene), R"({"jfpx_scene": 2,
 "name": "unnamed",
 "dt": 0.5,
 "solver": "soft_step",
 "soft_step": {"substeps":4,"contact_hertz":0.0,"damping_ratio":1.0,"push_out_speed":3.0,)"
                            R"("restitution_threshold":0.25,"speculative_margin":0.02},
 "resolver": {"max_iterations":0,"velocity_epsilon":0.01,"position_epsilon":0.01,)"
                            R"("restitution_velocity":0.25,"angular_limit":0.2},
 "sleep": {"enabled":true,"speed":0.05,"time":0.5,"epsilon":0.3,"bias":0.05},
 "materials": {"friction":"geometric_mean","restitution":"geometric_mean"},
 "bodies": [
  {"shape":{"type":"compound","parts":[{"shape":{"type":"box","half_extents":[1.0,2.0,3.0]},)"
                            R"("position":[0.0,0.0,0.0],"orientation":[1.0,0.0,0.0,0.0],)"
                            R"("density":1.0}]},"mass":1.0,"kinematic":false,)"
                            R"("position":[0.0,0.0,0.0],"orientation":[1.0,0.0,0.0,0.0],)"
                            R"("velocity":[0.0,0.0,0.0],"angular_velocity":[0.0,0.0,0.0],)"
                            R"("acceleration":[0.0,0.0,0.0],"linear_damping":1.0,)"
                            R"("angular_damping":1.0,"friction":0.5,"restitution":0.0,)"
                            R"("can_sleep":true,)"
                            R"("inertia":[[1.0,0.0,0.0],[0.0,1.0,0.0],[0.0,0.0,1.0]],)"
                            R"("filter":{"category":1,"mask":6},"rolling_friction":0.5,)"
                            R"("spinning_friction":0.5,"sensor":true,)"
                            R"("motion_locks":{"linear_y":true},"user_data":7}
]}
)");
}

TEST(SceneJson, ErrorsOfNewerFieldsNameFieldValueAndRange) {
  EXPECT_EQ(complaint(with_body("\"user_data\": -1")),
            "body 0.user_data: is -1; it must be a whole number from 0 to 2^64 - 1");
  EXPECT_THAT(complaint(with_body("\"user_data\": 1.5")), HasSubstr("is 1.5; it must be a whole"));
  EXPECT_THAT(complaint(with_body("\"user_data\": 18446744073709551616")),
              HasSubstr("body 0.user_data: is "));
  EXPECT_EQ(complaint(with_body("\"sensor\": 1")),
            "body 0.sensor: is a number; it must be a boolean");
  EXPECT_EQ(complaint(with_body("\"motion_locks\": {\"angular_y\": 1}")),
            "body 0.motion_locks.angular_y: is a number; it must be a boolean");
  EXPECT_EQ(complaint(with_body("\"filter\": {\"category\": -1}")),
            "body 0.filter.category: is -1; it must be a whole number from 0 to 4294967295");
  EXPECT_EQ(complaint(with_body("\"filter\": {\"mask\": 4294967296}")),
            "body 0.filter.mask: is 4294967296; it must be a whole number from 0 to 4294967295");
  EXPECT_EQ(complaint(with_body("\"filter\": {\"group\": 1}")),
            "body 0.filter: has an unknown field \"group\"; known fields are category, mask");
  EXPECT_EQ(complaint(with_body("\"filter\": 3")),
            "body 0.filter: is a number; it must be an object");
  const auto with_pairs = [](const std::string& pairs) {
    return R"({"jfpx_scene": 1, "bodies": [], "ignored_pairs": )" + pairs + "}";
  };
  EXPECT_EQ(complaint(with_pairs("3")), "scene.ignored_pairs: is a number; it must be an array");
  EXPECT_EQ(complaint(with_pairs("[[0]]")),
            "scene.ignored_pairs[0]: must be an array of 2 indices of bodies");
  EXPECT_EQ(complaint(with_pairs("[[0, 0.5]]")),
            "scene.ignored_pairs[0][1]: is 0.5; it must be a whole number from 0 to 4294967295");
  EXPECT_EQ(complaint(with_pairs("[[0, 1]]")),
            "scene: ignored_pairs[0] is (0, 1); it must be two different indices of the scene's 0 "
            "bodies");
}

TEST(SceneJson, AKeyThatIsGivenTwiceIsAnError) {
  const auto complaint = [](const char* text) -> std::string {
    try {
      from_json(text);
    } catch (const InvalidScene& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_EQ(complaint(R"({"version": 1, "dt": 0.01, "dt": 0.02, "bodies": []})"),
            "\"dt\" is given twice in one object");
  EXPECT_EQ(complaint(R"({"version": 1, "bodies": [{"mass": 1}, {"mass": 2, "mass": 2}]})"),
            "\"mass\" is given twice in one object");
  EXPECT_EQ(complaint(R"({"version": 1, "bodies": [{"mass": 1}, {"mass": 1}]})").find("twice"),
            std::string::npos);
}

TEST(SceneJson, BrokenTextGivesTheLineAndColumn) {
  EXPECT_THAT(complaint("{\n\"jfpx_scene\": 1,\n oops}"), HasSubstr("line 3, column 2"));
  EXPECT_THAT(complaint(""), HasSubstr("broken JSON"));
  EXPECT_THAT(complaint(with_body("\"mass\": 1e999")), HasSubstr("broken JSON"));
}

/// Copying or writing such a value would recurse once per nesting level.
TEST(SceneJson, NestedAHundredThousandTimesIsAnError) {
  const std::string deep = std::string(100'000, '[') + std::string(100'000, ']');
  EXPECT_THAT(complaint("{\"jfpx_scene\": " + deep + ", \"bodies\": []}"),
              HasSubstr("nested more than 64 deep"));
  EXPECT_THAT(complaint("{\"jfpx_scene\": [[1]], \"bodies\": []}"),
              HasSubstr("scene.jfpx_scene: is an array; "));
  EXPECT_EQ(complaint("{\"jfpx_scene\": 1, \"name\": \"" + std::string(200, '[') + "\\\"" +
                      std::string(200, '{') + "\", \"bodies\": []}"),
            "");
}

TEST(SceneJson, EveryTruncationIsAnError) {
  const std::string text = kMinimal;
  for (std::size_t size = 0; size < text.size(); ++size) {
    EXPECT_NE(complaint(text.substr(0, size)), "") << size;
  }
}

TEST(SceneJson, WrongVersionIsNamed) {
  EXPECT_EQ(complaint(R"({"jfpx_scene": 3, "bodies": []})"),
            "scene.jfpx_scene: is 3; this build reads schema versions 1 and 2");
  EXPECT_NE(complaint(R"({"jfpx_scene": 0, "bodies": []})"), "");
  EXPECT_THAT(complaint(R"({"bodies": []})"), HasSubstr("has no field \"jfpx_scene\""));
}

TEST(SceneJson, ErrorsNameBodyFieldValueAndRange) {
  EXPECT_THAT(complaint(with_body("\"mass\": \"heavy\"")),
              HasSubstr("body 0.mass: is a string; it must be a number"));
  EXPECT_THAT(complaint(with_body("\"weight\": 1")),
              HasSubstr("body 0: has an unknown field \"weight\"; known fields are"));
  EXPECT_THAT(complaint(with_body("\"position\": [1, 2]")),
              HasSubstr("body 0.position: must be an array of 3 numbers"));
  EXPECT_THAT(complaint(R"({"jfpx_scene": 1, "bodies": [{"mass": 1}]})"),
              HasSubstr("body 0: has no field \"shape\""));
  EXPECT_THAT(complaint(R"({"jfpx_scene": 1, "bodies": [{"shape": {"type": "torus"}}]})"),
              HasSubstr("\"torus\"; it must be sphere, box, half_space, plane, compound, capsule, "
                        "triangle_mesh, hull, heightfield, cylinder or cone"));
  const auto with_parts = [](const std::string& parts) {
    return R"({"jfpx_scene": 1, "bodies": [{"shape": {"type": "compound", "parts": )" + parts +
           "}}]}";
  };
  EXPECT_THAT(complaint(with_parts("{}")), HasSubstr("body 0.shape.parts: is an object; it must"));
  EXPECT_THAT(complaint(with_parts("[]")), HasSubstr("body 0: parts is empty"));
  EXPECT_THAT(complaint(with_parts(R"([{"shape": {"type": "plane"}}])")),
              HasSubstr("body 0.shape.parts[0].shape.type: is \"plane\"; it must be sphere, box, "
                        "capsule, hull, cylinder or cone"));
  EXPECT_THAT(complaint(with_parts(R"([{"shape": {"type": "sphere", "radius": -1}}])")),
              HasSubstr("body 0: parts[0].radius is -1; it must be > 0"));
  EXPECT_THAT(complaint(with_body("\"can_sleep\": 1")), HasSubstr("must be a boolean"));
  EXPECT_THAT(complaint(with_body("\"inertia\": [1, 1, 1]")),
              HasSubstr("body 0.inertia[0]: must be an array of 3 numbers"));
  EXPECT_THAT(complaint(with_body("\"inertia\": [[1, 0, 0]]")),
              HasSubstr("body 0.inertia: must be an array of 3 rows"));
  EXPECT_THAT(complaint(R"({"jfpx_scene": 1, "bodies": 3})"), HasSubstr("must be an array"));
  EXPECT_THAT(complaint(R"({"jfpx_scene": 1, "bodies": [], "resolver": {"max_iterations": -1}})"),
              HasSubstr("must be a whole number"));
}

TEST(SceneJson, MaterialRulesAreNamed) {
  for (const CombineRule rule :
       {CombineRule::geometric_mean, CombineRule::product, CombineRule::minimum,
        CombineRule::maximum, CombineRule::average}) {
    const std::string text = R"({"jfpx_scene": 1, "bodies": [], "materials": {"friction": ")" +
                             std::string(to_string(rule)) + R"("}})";
    EXPECT_EQ(from_json(text).materials, (MaterialSettings{rule, CombineRule::geometric_mean}));
  }
  EXPECT_EQ(complaint(R"({"jfpx_scene": 1, "bodies": [], "materials": {"restitution": "sum"}})"),
            "scene.materials.restitution: is \"sum\"; it must be one of geometric_mean, product, "
            "minimum, maximum, average");
  EXPECT_THAT(complaint(R"({"jfpx_scene": 1, "bodies": [], "materials": {"friction": 1}})"),
              HasSubstr("is a number; it must be a string"));
}

TEST(SceneJson, ValuesOutOfRangeAreInvalid) {
  EXPECT_THAT(complaint(with_body("\"mass\": -1")), HasSubstr("mass"));
  EXPECT_THAT(complaint(R"({"jfpx_scene": 1, "dt": 0, "bodies": []})"), HasSubstr("dt"));
}

/// Recordings of version 0.1 name the backend "x86".
TEST(RecordingHeader, TheOldNameOfTheCpuBackendIsRead) {
  const test::TemporaryFolder folder;
  const std::string path = folder.file("old.rec");
  RecordingWriter writer(path, {.engine = "native", .backend = "x86", .scene = {}});
  writer.finish();
  EXPECT_EQ(RecordingReader(path).header().backend, "cpu");
}

TEST(SceneFile, RoundTrips) {
  const test::TemporaryFolder folder;
  const Scene scene = scenes::make("columns", {.spheres = 40});
  save_scene(scene, folder.file("scene.json"));
  EXPECT_EQ(load_scene(folder.file("scene.json")), scene);
  EXPECT_EQ(folder.entries(), 1u) << "nothing is left beside the file";
}

TEST(SceneFile, UnreadableAndUnwritablePathsAreNamed) {
  const test::TemporaryFolder folder;
  EXPECT_THROW(load_scene(folder.file("missing.json")), FileError);
  EXPECT_THROW(save_scene(Scene{}, folder.file("no/such/folder.json")), FileError);
  std::ofstream(folder.file("bad.json")) << "{";
  try {
    load_scene(folder.file("bad.json"));
    FAIL();
  } catch (const InvalidScene& error) {
    EXPECT_THAT(error.what(), HasSubstr("bad.json: broken JSON"));
  }
}

}  // namespace
}  // namespace jfpx
