/// Tests of input scripts: round trips, errors, and replay.
#include "src/demos/input_script.hpp"

#include <jfpx/error.hpp>

#include "tests/support/temporary_folder.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace jfpx {
namespace {

using demos::InputScript;
using ::testing::HasSubstr;

/// The message of the error that parse_input_script() throws; empty if it throws none.
std::string complaint(std::string_view text) {
  try {
    demos::parse_input_script(text);
  } catch (const InvalidArgument& error) {
    return error.what();
  }
  return {};
}

TEST(InputScript, RoundTripsThroughText) {
  InputScript script;
  script.demo = "flight";
  script.lines = {{1, "pitch-up", true}, {1, "level", true}, {18446744073709551615u, "x", false}};
  EXPECT_EQ(demos::parse_input_script(to_text(script)), script);
  const InputScript empty{.demo = "ballistic", .lines = {}};
  EXPECT_EQ(demos::parse_input_script(to_text(empty)), empty);
}

TEST(InputScript, HasCommentsAndBlankLines) {
  const InputScript script = demos::parse_input_script(
      "# a run\n\njfpx-input 1 flight  # the demo\r\n  3\tlevel   press # now\n#4 level release");
  EXPECT_EQ(script.demo, "flight");
  ASSERT_EQ(script.lines.size(), 1u);
  EXPECT_EQ(script.lines[0], (demos::ScriptLine{3, "level", true}));
}

TEST(InputScript, ErrorsNameTheLine) {
  EXPECT_THAT(complaint(""), HasSubstr("line 1: must have the form jfpx-input 1 DEMO"));
  EXPECT_THAT(complaint("\njfpx-input 2 flight"),
              HasSubstr("line 2: must have the form jfpx-input 1"));
  EXPECT_THAT(complaint("jfpx-input 1"), HasSubstr("line 1"));
  const auto second = [](const std::string& line) {
    return complaint("jfpx-input 1 flight\n" + line);
  };
  EXPECT_THAT(second("3 level"), HasSubstr("line 2: has 2 words"));
  EXPECT_THAT(second("3 level press now"), HasSubstr("has 4 words"));
  EXPECT_THAT(second("3 level down"), HasSubstr("ends in \"down\""));
  EXPECT_THAT(second("0 level press"), HasSubstr("step is 0"));
  EXPECT_THAT(second("-1 level press"), HasSubstr("step is -1"));
  EXPECT_THAT(second("1.5 level press"), HasSubstr("step is 1.5"));
  EXPECT_THAT(second("18446744073709551616 level press"),
              HasSubstr("step is 18446744073709551616"));
  EXPECT_THAT(second("5 level press\n4 level release"), HasSubstr("line 3: step 4 follows step 5"));
}

TEST(InputScript, ErrorsOfFilesNameTheFile) {
  const test::TemporaryFolder folder;
  const std::string path = folder.file("run.input");
  EXPECT_THROW(demos::load_input_script(path), FileError);
  const InputScript script{.demo = "flight", .lines = {{7, "level", true}}};
  demos::save_input_script(script, path);
  EXPECT_EQ(demos::load_input_script(path), script);
  demos::save_input_script({.demo = "two words", .lines = {}}, path);
  try {
    demos::load_input_script(path);
    FAIL();
  } catch (const InvalidArgument& error) {
    EXPECT_THAT(error.what(), HasSubstr("run.input: line 1"));
  }
}

TEST(ScriptPlayer, RefusesAnotherDemoAndUnknownControls) {
  const auto demo = demos::make("flight");
  EXPECT_THROW(demos::ScriptPlayer({.demo = "ballistic", .lines = {}}, *demo), InvalidArgument);
  EXPECT_THROW(demos::ScriptPlayer({.demo = "flight", .lines = {{1, "fire", true}}}, *demo),
               InvalidArgument);
}

TEST(ScriptPlayer, SuppliesTheInputsOfEachStepInOrder) {
  const auto demo = demos::make("ballistic");
  demos::ScriptPlayer player(
      {.demo = "ballistic", .lines = {{2, "pistol", true}, {2, "fire", true}, {4, "fire", false}}},
      *demo);
  EXPECT_TRUE(player.next().empty());
  const auto second = player.next();
  ASSERT_EQ(second.size(), 2u);
  EXPECT_EQ(second[0].control, find_control(*demo, "pistol"));
  EXPECT_EQ(second[1].control, find_control(*demo, "fire"));
  EXPECT_TRUE(player.next().empty());
  EXPECT_FALSE(player.finished());
  ASSERT_EQ(player.next().size(), 1u);
  EXPECT_TRUE(player.finished());
  EXPECT_TRUE(player.next().empty());
}

}  // namespace
}  // namespace jfpx
