/// Tests of the demo interface: the table of demos, the mapping of inputs to actions, and
/// repeatability.
#include <jfpx/error.hpp>

#include "src/demos/input_script.hpp"
#include "tests/world/support.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <set>
#include <string>

namespace jfpx {
namespace {

using demos::Demo;
using demos::Input;
using ::testing::HasSubstr;

TEST(Demos, RunDrawAndRepeatBitForBit) {
  for (const demos::Entry& entry : demos::all()) {
    SCOPED_TRACE(entry.name);
    const auto once = demos::make(entry.name), again = demos::make(entry.name);
    EXPECT_EQ(once->name(), entry.name);
    demos::View view;
    for (std::size_t n = 0; n < 40; ++n) {
      // The controls are pressed one after the other, and each is held for two steps.
      std::vector<Input> inputs;
      const std::size_t count = once->controls().size();
      inputs.push_back({n % count, true});
      if (n >= 2) inputs.push_back({(n - 2) % count, false});
      EXPECT_FALSE(once->step(inputs).non_finite);
      again->step(inputs);
      once->draw(&view);
    }
    EXPECT_EQ(once->state_hash(), again->state_hash());
    EXPECT_NE(view.camera.eye, view.camera.target);
  }
}

TEST(Demos, ControlNamesAreValidInScripts) {
  for (const demos::Entry& entry : demos::all()) {
    SCOPED_TRACE(entry.name);
    const auto demo = demos::make(entry.name);
    std::set<std::string_view> names;
    for (const demos::Control& control : demo->controls()) {
      EXPECT_FALSE(control.name.empty());
      EXPECT_EQ(control.name.find_first_of(" \t\n#"), std::string_view::npos) << control.name;
      EXPECT_FALSE(control.summary.empty()) << control.name;
      EXPECT_FALSE(control.key.empty()) << control.name;
      EXPECT_TRUE(names.insert(control.name).second) << control.name;
    }
  }
}

TEST(Demos, EveryNamedSceneIsADemoAndMovesAsItsWorld) {
  for (const scenes::Entry& entry : scenes::all()) {
    const demos::Options options{.scene = {.spheres = 30, .seed = 2}};
    const auto demo = demos::make(entry.name, options);
    World world(scenes::make(entry.name, options.scene));
    for (int n = 0; n < 5; ++n) {
      demo->step();
      world.step();
    }
    EXPECT_EQ(demo->state_hash(), world.state_hash()) << entry.name;
    EXPECT_EQ(demo->world()->time(), world.time());
    demo->step(std::vector<Input>{{find_control(*demo, "reset"), true}});
    World fresh(scenes::make(entry.name, options.scene));
    fresh.step();
    EXPECT_EQ(demo->state_hash(), fresh.state_hash()) << entry.name;
  }
}

TEST(Demos, BadNamesAndStepsAreRefused) {
  EXPECT_THROW(demos::make("filght"), InvalidArgument);
  try {
    find_control(*demos::make("ballistic"), "jump");
    FAIL();
  } catch (const InvalidArgument& error) {
    EXPECT_THAT(error.what(), HasSubstr("\"jump\"; controls are pistol, artillery"));
  }
  EXPECT_THROW(demos::make("flight", {.dt = Real(0)}), Error);
  EXPECT_THROW(demos::make("boxes-and-balls", {.dt = Real(-1)}), Error);
}

TEST(ScriptRecorder, ARecordedRunRepeatsBitForBit) {
  const std::uint64_t seed = test::fresh_seed();
  SCOPED_TRACE(test::trace(seed));
  for (const demos::Entry& entry : demos::all()) {
    SCOPED_TRACE(entry.name);
    Random random(seed);
    const demos::Options options{.scene = {.spheres = 5}};
    const auto played = demos::make(entry.name, options);
    const auto controls = played->controls().size();
    demos::ScriptRecorder recorder(*played);
    for (int n = 0; n < 200; ++n) {
      std::vector<Input> inputs;
      for (std::uint64_t k = random.below(3); k-- > 0;) {
        inputs.push_back({random.below(controls), random.below(2) == 0});
      }
      recorder.add_step(inputs);
      played->step(inputs);
    }
    const auto repeated = demos::make(entry.name, options);
    demos::ScriptPlayer player(demos::parse_input_script(to_text(recorder.script())), *repeated);
    for (int n = 0; n < 200; ++n) repeated->step(player.next());
    EXPECT_EQ(repeated->state_hash(), played->state_hash());
  }
}

TEST(ScriptPlayer, EveryDemoHasAScriptThatChangesItsStates) {
  for (const demos::Entry& entry : demos::all()) {
    SCOPED_TRACE(entry.name);
    const demos::Options options{.scene = {.spheres = 3}};
    const auto played = demos::make(entry.name, options), idle = demos::make(entry.name, options);
    demos::ScriptPlayer player(
        demos::load_input_script(JFPX_INPUTS + std::string(entry.name) + ".input"), *played);
    bool differ = false;
    while (!player.finished()) {
      EXPECT_FALSE(played->step(player.next()).non_finite);
      idle->step();
      differ = differ || played->state_hash() != idle->state_hash();
    }
    EXPECT_TRUE(differ);
  }
}

/// A demo that records its actions: control 0 acts once per press, control 1 in every step.
class Counter final : public Demo {
 public:
  static constexpr demos::Control kControls[] = {{"once", "acts once", "o"},
                                                 {"held", "acts while down", "h", true}};
  Counter() : Demo(kControls) {}
  std::string_view name() const override { return "counter"; }
  Real dt() const override { return 1; }
  std::vector<BodyState> states() const override { return {}; }
  void draw(demos::View*) const override {}

  std::string acted;

 private:
  void act(std::size_t control) override { acted += static_cast<char>('0' + control); }
  StepReport advance() override {
    acted += ' ';
    return {};
  }
};

void step(Counter* demo, std::vector<Input> inputs) { demo->step(inputs); }

TEST(Erratum, E42_press_and_release_in_one_step_act_once_and_leave_no_control_down) {
  Counter demo;
  step(&demo, {{1, true}, {1, false}, {0, true}, {0, false}});
  step(&demo, {});
  EXPECT_EQ(demo.acted, "10  ");  // in reverse order, both controls would stay down
}

TEST(Erratum, E42_an_invalid_control_is_refused_and_changes_nothing) {
  Counter demo;
  try {
    step(&demo, {{1, true}, {2, true}});
    FAIL();
  } catch (const InvalidArgument& error) {
    EXPECT_THAT(error.what(), HasSubstr("control is 2; it must be less than"));
  }
  step(&demo, {});
  EXPECT_EQ(demo.acted, " ");
}

TEST(Demos, HeldControlsActInEveryStepAndOthersOncePerPress) {
  Counter demo;
  step(&demo, {{0, true}, {1, true}});
  step(&demo, {{0, true}});  // key repeat
  step(&demo, {{1, false}, {0, false}});
  step(&demo, {{0, true}});
  EXPECT_EQ(demo.acted, "01 1  0 ");
}

}  // namespace
}  // namespace jfpx
