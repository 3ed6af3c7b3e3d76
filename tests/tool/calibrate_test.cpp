/// jfpx calibrate, and the use of its file by the other commands.
#include <jfpx/backend.hpp>
#include <jfpx/cost_model.hpp>

#include "src/base/system.hpp"
#include "tests/support/environment.hpp"
#include "tests/support/process.hpp"
#include "tests/support/temporary_folder.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <filesystem>
#include <fstream>
#include <optional>

namespace jfpx {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

/// Runs the command with a separate cache folder.
class Calibrate : public testing::Test {
 protected:
  test::ProcessResult jfpx(const std::string& arguments, const char* redirect = " 2>&1") {
    return test::run_process(JFPX_TOOL_PATH " " + arguments + redirect);
  }
  std::string path() const {
    return folder_.file(sizeof(Real) == 4 ? "jfpx/cost-model-float.json"
                                          : "jfpx/cost-model-double.json");
  }
  void write(const std::string& content) {
    std::filesystem::create_directories(folder_.file("jfpx"));
    std::ofstream(path()) << content;
  }
  static constexpr const char* kRun = "run gas --spheres 10 --steps 1 --hash";

  test::TemporaryFolder folder_;
  test::EnvironmentVariable cache_{test::kCacheVariable, folder_.file("")};
};

TEST_F(Calibrate, StoresCostsThatProgramsCanLoad) {
  const CalibratedCosts before = calibrated_costs();
  EXPECT_EQ(before.problem, "this machine was not measured yet");
  EXPECT_EQ(before.costs, CostModel());
  ASSERT_EQ(jfpx("calibrate").status, 0);
  const CalibratedCosts after = calibrated_costs();
  EXPECT_EQ(after.problem, "");
  EXPECT_EQ(after.costs, load_cost_model(path()).costs);
  EXPECT_NE(after.costs, CostModel());
  write("{");
  EXPECT_THAT(calibrated_costs().problem, HasSubstr(path()));
  EXPECT_EQ(calibrated_costs().costs, CostModel());
}

TEST_F(Calibrate, StoresCostsThatTheOtherCommandsUse) {
  const auto result = jfpx("calibrate");
  EXPECT_EQ(result.status, 0) << result.output;
  EXPECT_THAT(result.output, HasSubstr("cpu, grid"));
  EXPECT_THAT(result.output, HasSubstr(path()));
  EXPECT_THAT(result.output, Not(HasSubstr("measuring"))) << "progress is shown on terminals only";
  const MeasuredCostModel model = load_cost_model(path());
  EXPECT_GT(model.costs.cpu_all_pairs.pair_ns, 0.0);
  EXPECT_GT(model.costs.cpu_grid.sphere_ns, 0.0);
  EXPECT_GT(model.costs.cpu_given_pairs.pair_ns, 0.0);
  EXPECT_GT(model.costs.cpu_world.sphere_ns, 0.0);
  EXPECT_FALSE(model.origin.machine.empty());
  EXPECT_EQ(model.origin.version, JFPX_VERSION);
  EXPECT_EQ(folder_.entries(), 1u);

  EXPECT_THAT(jfpx(kRun).output, Not(HasSubstr("default costs")));
  const auto shown = jfpx("calibrate --show --json -", test::kWithoutErrors);
  EXPECT_EQ(nlohmann::json::parse(shown.output)["cpu_all_pairs"]["pair_ns"],
            model.costs.cpu_all_pairs.pair_ns);
}

TEST_F(Calibrate, ReportsCudaOnlyWhereItIsUsable) {
  bool usable = false;
  for (const BackendStatus& status : available_backends()) {
    if (status.backend == Backend::cuda) usable = status.usable;
  }
  for (const std::string command : {"calibrate --show", "calibrate"}) {
    const auto result = jfpx(command, test::kWithoutErrors);
    EXPECT_THAT(result.output, HasSubstr("cpu: grid instead of all pairs"));
    EXPECT_EQ(result.output.find("cuda") != std::string::npos, usable) << result.output;
  }
}

TEST_F(Calibrate, WithoutAFileTheDefaultsAreUsedWithoutAMessage) {
  const auto run = jfpx(kRun);
  EXPECT_EQ(run.status, 0);
  EXPECT_THAT(run.output, Not(HasSubstr("costs")));
  const auto shown = jfpx("calibrate --show");
  EXPECT_EQ(shown.status, 0);
  EXPECT_THAT(shown.output,
              HasSubstr("this machine was not measured yet: showing the default costs"));
  EXPECT_EQ(folder_.entries(), 0u) << "only calibrate writes";
}

TEST_F(Calibrate, ABrokenFileIsIgnoredWithOneLineAndTheSameBits) {
  const std::string hash = jfpx(std::string(kRun) + " --quiet").output;
  for (const char* content : {"", "{", "null", "{\"jfpx_cost_model\": 1}", "\xff\xfe"}) {
    write(content);
    const auto run = jfpx(kRun);
    EXPECT_EQ(run.status, 0) << content;
    EXPECT_THAT(run.output, HasSubstr("default costs are used")) << content;
    EXPECT_THAT(run.output, HasSubstr(path())) << content;
    EXPECT_THAT(run.output, HasSubstr(hash)) << content;
    EXPECT_EQ(jfpx(std::string(kRun) + " --quiet").output, hash);
    EXPECT_THAT(jfpx(std::string(kRun) + " --backend cpu").output, Not(HasSubstr("costs")));
  }
  std::filesystem::remove(path());
  std::filesystem::create_directory(path());
  EXPECT_EQ(jfpx(kRun).status, 0) << "a folder instead of the file";
}

TEST_F(Calibrate, AFileOfAnotherMachineDriverOrVersionIsIgnored) {
  ASSERT_EQ(jfpx("calibrate --quiet").status, 0);
  const auto good = nlohmann::ordered_json::parse(std::ifstream(path()));
  EXPECT_THAT(jfpx(kRun).output, Not(HasSubstr("default costs")));
  for (const char* part : {"machine", "driver", "version"}) {
    auto stale = good;
    stale[part] = "another";
    write(stale.dump());
    EXPECT_THAT(jfpx(kRun).output, HasSubstr("default costs are used")) << part;
  }
}

TEST_F(Calibrate, DefaultCostsAreNotAcceptedAsMeasured) {
  write(jfpx("calibrate --show --json -", test::kWithoutErrors).output);
  EXPECT_EQ(load_cost_model(path()).costs, CostModel());
  EXPECT_THAT(jfpx(kRun).output, HasSubstr("was measured on another machine: none"));
}

TEST_F(Calibrate, AFolderThatCannotBeCreatedIsAnErrorOfCalibrateOnly) {
  std::ofstream(folder_.file("jfpx")) << "a file where the folder should be";
  EXPECT_EQ(jfpx(kRun).status, 0);
  const auto result = jfpx("calibrate --quiet");
  EXPECT_EQ(result.status, 2);
  EXPECT_THAT(result.output, HasSubstr(path()));
}

TEST_F(Calibrate, WithoutAHomeNothingIsStored) {
  const test::EnvironmentVariable cache(test::kCacheVariable, std::nullopt);
  const test::EnvironmentVariable home("HOME", std::nullopt);
  EXPECT_EQ(jfpx(kRun).status, 0);
  const auto result = jfpx("calibrate --quiet");
  EXPECT_EQ(result.status, 2);
  EXPECT_THAT(result.output, HasSubstr(std::string(kCacheFolderVariable) + " is not set"));
}

}  // namespace
}  // namespace jfpx
