/// The jfpx command: output, exit statuses, errors and files.
#include <jfpx/backend.hpp>
#include <jfpx/recorded_world.hpp>
#include <jfpx/recording.hpp>
#include <jfpx/scene.hpp>

#include "src/base/hash64.hpp"
#include "src/demos/demo.hpp"
#include "src/scenes/scenes.hpp"
#include "tests/support/process.hpp"
#include "tests/support/temporary_folder.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <sstream>
#include <utility>

namespace jfpx {
namespace {

using test::ProcessResult;
using ::testing::HasSubstr;
using ::testing::Not;

constexpr const char* kOtherPrecision = sizeof(Real) == 4 ? "double" : "float";

/// Runs the command; its output includes stderr.
ProcessResult jfpx_command(const std::string& arguments) {
  return test::run_process(std::string(JFPX_TOOL_PATH) + " " + arguments + " 2>&1");
}
/// Runs the command; its output is stdout only.
ProcessResult jfpx_stdout(const std::string& arguments) {
  return test::run_process(std::string(JFPX_TOOL_PATH) + " " + arguments + test::kWithoutErrors);
}

/// A line of 16 hexadecimal digits.
bool is_hash(const std::string& text) {
  return text.size() == 17 && text.find_first_not_of("0123456789abcdef") == 16 && text[16] == '\n';
}

bool cuda_usable() {
  for (const BackendStatus& status : available_backends()) {
    if (status.backend == Backend::cuda) return status.usable;
  }
  return false;
}

void expect_fails(const std::string& arguments, int status, const std::string& message) {
  const ProcessResult result = jfpx_command(arguments);
  EXPECT_EQ(result.status, status) << arguments << "\n" << result.output;
  EXPECT_THAT(result.output, HasSubstr(message)) << arguments;
}

/// Two spheres, one of which exceeds kMaxCoordinate after a step.
void save_runaway(const std::string& path) {
  Scene scene;
  scene.dt = 1;
  scene.bodies.resize(2);
  for (BodyDef& body : scene.bodies) body.shape = Sphere{1};
  scene.bodies[1].position = {Real(0.999e9), 0, 0};
  scene.bodies[1].velocity = {Real(1e7), 0, 0};
  save_scene(scene, path);
}

TEST(Tool, HelpNamesTheCommandsAndExitStatuses) {
  const ProcessResult result = jfpx_command("--help");
  EXPECT_EQ(result.status, 0);
  for (const char* word : {"compare", "run", "replay", "scenes", "devices", "Exit status"}) {
    EXPECT_THAT(result.output, HasSubstr(word));
  }
  EXPECT_EQ(jfpx_command("run --help").status, 0);
  EXPECT_EQ(jfpx_command("--version").output, "jfpx " JFPX_VERSION "\n");
}

TEST(Tool, BadUsageIsStatusTwo) {
  expect_fails("", 2, "subcommand");
  expect_fails("fly", 2, "there is no command \"fly\"");
  expect_fails("--bogus", 2, "there is no option \"--bogus\"");
  expect_fails("run", 2, "SCENE");
  expect_fails("run pile --speres 3", 2, "--speres");
  expect_fails("run pile --steps many", 2, "--steps");
  expect_fails("run pile --steps -1", 2, "--steps");
  expect_fails("run pile --seed 18446744073709551616", 2, "--seed");
  expect_fails("run pile --engine havok", 2, "havok");
  expect_fails("run pile --backend vulkan", 2, "vulkan");
  expect_fails("run pile --solver ode", 2, "ode");
  expect_fails("run pile --world ode", 2, "ode");
  expect_fails("run pile --precision half", 2, "half");
  expect_fails("run pile --resolver best-first", 2, "best-first");
  expect_fails("run pile --substeps 0", 2, "substeps is 0");
  expect_fails("run pile --substeps 65", 2, "substeps is 65");
  expect_fails("run pile --trajectory run.dump", 2, "has the extension \".dump\"");
  expect_fails("run pile --trajectory /nowhere/run.pvd", 2, "/nowhere/run.pvd: can't be written");
  expect_fails("run pile --trajectory-every 2", 2, "--trajectory-every requires --trajectory");
  expect_fails("run pile --trajectory run.xyz --trajectory-every 0", 2,
               "--trajectory-every is 0; it must be at least 1");
  expect_fails("run flight --trajectory run.xyz", 2, "--trajectory requires a scene");
  expect_fails("run flight --states run.npy", 2, "--states requires a scene");
  expect_fails("run pile --states /nowhere/run.npy", 2, "/nowhere/run.npy: can't be written");
  expect_fails("scenes --export", 2, "SCENE");
  expect_fails("scenes --spheres 5", 2, "SCENE");
}

TEST(Tool, OptionsThatWouldDoNothingAreRefused) {
  for (const std::string engine : {"native", "bullet-stock"}) {
    for (const std::string option : {"--solver stock", "--world jfpx", "--minimum-batch 3"}) {
      expect_fails("run pile --engine " + engine + " " + option, 2,
                   "requires --engine bullet; engine is " + engine);
    }
  }
  for (const std::string engine : {"bullet", "bullet-stock"}) {
    for (const std::string option : {"--resolver soft-step", "--substeps 2", "--devices 0,1"}) {
      expect_fails("run pile --engine " + engine + " " + option, 2,
                   "requires --engine native; engine is " + engine);
    }
  }
  expect_fails("run pile --devices 0,1 --backend cpu", 2, "the backend is cpu");
  expect_fails("run pile --devices 0,one", 2, "--devices");
  for (const std::string command : {"run", "compare", "scenes"}) {
    expect_fails(command + " pile --resolver worst-first --substeps 2", 2,
                 "--substeps requires --resolver soft-step; resolver is worst-first");
  }
}

#if !defined(_WIN32)  // a shell that sets variables
TEST(Tool, SeveralProcessesDoNotDoTheSame) {
  const auto started = [](const std::string& environment, const std::string& arguments) {
    return test::run_process(environment + " " JFPX_TOOL_PATH " " + arguments + " 2>&1");
  };
  for (const std::string several : {"OMPI_COMM_WORLD_SIZE=3", "PMI_SIZE=2", "PMIX_RANK=1",
                                    "PMIX_RANK=0 SLURM_STEP_NUM_TASKS=2"}) {
    const ProcessResult result = started(several, "scenes");
    EXPECT_EQ(result.status, 2) << several;
    EXPECT_THAT(result.output, HasSubstr("jfpx scenes runs as one process")) << several;
#if !JFPX_HAS_MPI
    const ProcessResult run = started(several, "run pile --steps 1");
    EXPECT_EQ(run.status, 2) << several;
    EXPECT_THAT(run.output, HasSubstr("this program is built without MPI")) << several;
#endif
  }
  for (const std::string one :
       {"OMPI_COMM_WORLD_SIZE=1 PMIX_RANK=0", "PMI_SIZE=1", "PMIX_RANK=0 SLURM_STEP_NUM_TASKS=1"}) {
    EXPECT_EQ(started(one, "scenes").status, 0) << one;
    EXPECT_EQ(started(one, "run pile --steps 1").status, 0) << one;
  }
}
#endif

#if !defined(_WIN32)  // devices in the file system
TEST(Tool, OutputThatIsLostIsAnError) {
  for (const std::string arguments : {"--version", "scenes", "scenes pile --spheres 5 --export",
                                      "run pile --steps 1 --quiet --json -"}) {
    const ProcessResult result =
        test::run_process(JFPX_TOOL_PATH " " + arguments + " 2>&1 >/dev/full");
    EXPECT_EQ(result.status, 2) << arguments;
    EXPECT_THAT(result.output, HasSubstr("No space left on device")) << arguments;
  }
  // Through a symbolic link, which a faulty implementation would replace.
  const test::TemporaryFolder folder;
  std::filesystem::create_symlink("/dev/full", folder.file("full"));
  expect_fails("run pile --steps 1 --csv " + folder.file("full"), 2, "can't be written: No space");
  std::filesystem::create_symlink("/dev/full", folder.file("full.xyz"));
  expect_fails("run pile --steps 1 --trajectory " + folder.file("full.xyz"), 2,
               "full.xyz: can't be written: No space");
}
#endif

TEST(Tool, ATrajectoryHasTheFramesThatAreSelected) {
  const test::TemporaryFolder folder;
  const std::string path = folder.file("run.xyz");
  for (const std::string& engine : {std::string("native"), std::string("bullet-stock")}) {
    if (!JFPX_HAS_BULLET && engine != "native") continue;
    const ProcessResult result =
        jfpx_command("run pile --spheres 5 --steps 10 --quiet --trajectory-every 4 --trajectory " +
                     path + " --engine " + engine);
    EXPECT_EQ(result.status, 0) << result.output;
    std::ifstream file(path);
    std::string steps;
    for (std::string line; std::getline(file, line);) {
      const std::size_t at = line.find(" Step=");
      if (at != std::string::npos) steps += line.substr(at, line.find(' ', at + 1) - at);
    }
    EXPECT_EQ(steps, " Step=0 Step=4 Step=8") << engine;
  }
}

#if !defined(_WIN32)
TEST(Tool, ResultsGoThroughLinksToDevices) {
  const test::TemporaryFolder folder;
  const std::string link = folder.file("link");
  std::filesystem::create_symlink("/dev/stdout", link);
  const ProcessResult piped = jfpx_stdout("run pile --steps 1 --quiet --json " + link);
  EXPECT_EQ(piped.status, 0);
  EXPECT_EQ(nlohmann::json::parse(piped.output)["steps"], 1);
  EXPECT_TRUE(std::filesystem::is_symlink(link));
  EXPECT_EQ(folder.entries(), 1u);
}
#endif

TEST(Tool, JsonIsTheOnlyOutputOnStdout) {
  for (const std::string command : {"run", JFPX_HAS_BULLET ? "compare" : "run"}) {
    const ProcessResult result = jfpx_stdout(command + " pile --spheres 8 --steps 2 --json -");
    EXPECT_EQ(nlohmann::json::parse(result.output)["steps"], 2) << command;
  }
}

TEST(Tool, OnlyOneOptionWritesToStdout) {
  for (const std::string command : {"run", JFPX_HAS_BULLET ? "compare" : "run"}) {
    expect_fails(command + " pile --steps 1 --json - --hash", 2,
                 "--hash can't be combined with --json -");
  }
  expect_fails("run pile --steps 1 --csv - --hash", 2, "--hash can't be combined with --csv -");
  expect_fails("run pile --steps 1 --csv - --json -", 2, "--json - can't be combined with --csv -");
}

TEST(Tool, CsvIsTheOnlyOutputOnStdout) {
  const test::TemporaryFolder folder;
  const std::string run = "run pile --spheres 8 --steps 3 --csv ";
  ASSERT_EQ(jfpx_command(run + folder.file("a.csv")).status, 0);
  std::ifstream file(folder.file("a.csv"));
  const std::string content(std::istreambuf_iterator<char>(file), {});
  const std::string output = jfpx_stdout(run + "-").output;
  EXPECT_EQ(std::ranges::count(output, '\n'), std::ranges::count(content, '\n'));
  EXPECT_EQ(output.substr(0, output.find('\n')), content.substr(0, content.find('\n')));
}

TEST(Tool, NumbersOutOfRangeNameTheRange) {
  for (const std::string number : {"-1", "257", "1000", "99999999999999999999", "two"}) {
    expect_fails("run pile --threads " + number, 2,
                 "is " + number + "; it must be a whole number from 0 to 256");
  }
  for (const std::string option : {"--spheres", "--boxes"}) {
    for (const std::string number : {"-1", "5000000000"}) {
      expect_fails("run pile " + option + " " + number, 2,
                   "is " + number + "; it must be a whole number from 0 to 4294967295");
    }
  }
  expect_fails("run pile --steps -1", 2,
               "is -1; it must be a whole number from 0 to 18446744073709551615");
}

#if !defined(_WIN32)  // programs that send signals
TEST(Tool, AnInterruptedRunLeavesNoFiles) {
  for (const auto& [signal, status] : {std::pair("INT", 130), {"TERM", 143}, {"HUP", 129}}) {
    const test::TemporaryFolder folder;
    // Without --foreground, timeout also signals the process group; a second signal ends the
    // program immediately.
    const ProcessResult result = test::run_process(
        "timeout --foreground --preserve-status -s " + std::string(signal) +
        " 0.5 " JFPX_TOOL_PATH " run pile --spheres 50 --steps 100000000 --quiet --record " +
        folder.file("run.rec") + " --csv " + folder.file("run.csv") + " --trajectory " +
        folder.file("run.pvd") + " --trajectory-every 1000");
    EXPECT_EQ(result.status, status) << "ends by the signal";
    EXPECT_EQ(folder.entries(), 0u) << signal;
  }
}
#endif

TEST(Tool, BadInputIsStatusTwoAndNamed) {
  expect_fails("run plie", 2, "there is no scene called \"plie\"");
  expect_fails("run pile --dt 0", 2, "dt");
  expect_fails("run pile --dt nan", 2, "dt");
  expect_fails("run pile --dt -0.1", 2, "dt");
  expect_fails("run pile --spheres 4294967295", 2, "MiB");
  expect_fails("run missing.json", 2, "missing.json: can't be opened");
  expect_fails("run pile --threads 100000", 2, "threads");
}

#if !JFPX_HAS_BULLET || !defined(__linux__)
TEST(Tool, PreloadSaysWhyItIsNotAvailable) {
  expect_fails("preload program --option", 3, "preload: ");
}
#endif

TEST(Tool, SceneFilesAreChecked) {
  const test::TemporaryFolder folder;
  const std::string path = folder.file("scene.json");
  std::ofstream(path) << "{\"jfpx_scene\": 1, \"bodies\": [}";
  expect_fails("run " + path, 2, "scene.json: broken JSON");
  save_scene(scenes::make("pile", {.spheres = 5}), path);
  for (const std::string option : {"--spheres", "--seed"}) {
    expect_fails("run " + path + " " + option + " 3", 2, option + " requires a named scene");
  }
  EXPECT_EQ(jfpx_command("run " + path + " --steps 2").status, 0);
}

TEST(Tool, ABodyThatRunsAwayIsNamedAndStatusOne) {
  const test::TemporaryFolder folder;
  const std::string path = folder.file("scene.json");
  const std::string recording = folder.file("run.rec");
  save_runaway(path);
  const std::string message = "step 0: body 1 became non-finite";
  expect_fails("run " + path + " --steps 3 --record " + recording, 1, message);
  expect_fails("replay " + recording, 1, message);
}

TEST(Tool, ProgressIsDrawnOnTerminalsOnly) {
#if !defined(_WIN32)
  const std::string run = std::string(JFPX_TOOL_PATH) + " run pile --spheres 8 --steps 30";
  EXPECT_THAT(test::run_process("script -qec '" + run + "' /dev/null").output,
              HasSubstr("100% 30/30"));
  EXPECT_THAT(test::run_process("script -qec '" + run + " --quiet' /dev/null").output,
              Not(HasSubstr("%")));
#endif
  EXPECT_THAT(jfpx_command("run pile --spheres 8 --steps 30").output, Not(HasSubstr("%")));
}

TEST(Tool, ScenesAreListedDescribedAndExported) {
  const ProcessResult list = jfpx_stdout("scenes");
  EXPECT_EQ(list.status, 0);
  for (const scenes::Entry& entry : scenes::all()) {
    EXPECT_THAT(list.output, HasSubstr(std::string(entry.name)));
  }
  EXPECT_THAT(jfpx_stdout("scenes pile --spheres 30").output, HasSubstr("pile: 35 bodies, 30"));
  for (const std::string resolver : {"soft-step", "worst-first"}) {
    EXPECT_THAT(jfpx_stdout("scenes pile --spheres 3 --resolver " + resolver).output,
                HasSubstr("resolver " + resolver + "\n"));
  }
  const ProcessResult text = jfpx_stdout("scenes gas --spheres 10 --seed 5 --export");
  EXPECT_EQ(from_json(text.output), scenes::make("gas", {.spheres = 10, .seed = 5}));
}

TEST(Tool, DemosAreListedWithTheirControls) {
  const std::string list = jfpx_stdout("scenes").output;
  for (const demos::Entry& entry : demos::all()) {
    EXPECT_THAT(list, HasSubstr(std::string(entry.name)));
    const ProcessResult result = jfpx_stdout("scenes " + std::string(entry.name));
    EXPECT_EQ(result.status, 0);
    for (const demos::Control& control : demos::make(entry.name)->controls()) {
      EXPECT_THAT(result.output, HasSubstr(std::string(control.name)));
    }
  }
}

TEST(Tool, DemosRunWithTheirInputsAndRepeatExactly) {
  const test::TemporaryFolder folder;
  const std::string script = folder.file("shots.input");
  std::ofstream(script) << "jfpx-input 1 ballistic\n2 fire press\n2 fire release\n5 fire press\n";
  const std::string arguments = "run ballistic --steps 30 --quiet --hash";
  const ProcessResult shots = jfpx_stdout(arguments + " --input " + script);
  EXPECT_EQ(shots.status, 0);
  EXPECT_TRUE(is_hash(shots.output)) << shots.output;
  EXPECT_EQ(jfpx_stdout(arguments + " --input " + script).output, shots.output);
  EXPECT_NE(jfpx_stdout(arguments).output, shots.output);
  const auto json = nlohmann::json::parse(
      jfpx_stdout("run ballistic --steps 30 --quiet --json - --input " + script).output);
  EXPECT_EQ(json["scene"], "ballistic");
  EXPECT_EQ(json["awake"], 2);
  EXPECT_EQ(json["bodies"], 2);
}

TEST(Tool, ASceneWithoutInputsIsTheSameAsADemo) {
  const test::TemporaryFolder folder;
  const std::string script = folder.file("none.input");
  std::ofstream(script) << "jfpx-input 1 mixed\n";
  const std::string arguments = "run mixed --spheres 20 --boxes 7 --steps 40 --quiet --hash";
  EXPECT_EQ(jfpx_stdout(arguments + " --input " + script).output, jfpx_stdout(arguments).output);
}

TEST(Tool, OptionsThatDemosDoNotSupportAreRejected) {
  const test::TemporaryFolder folder;
  const std::string script = folder.file("x.input");
  std::ofstream(script) << "jfpx-input 1 flight\n1 fire press\n";
  expect_fails("run flight --input " + script, 2, "\"flight\" has no control \"fire\"");
  expect_fails("run ballistic --input " + script, 2,
               "is for the demo \"flight\", not for \"ballistic\"");
  expect_fails("run flight --input " + folder.file("none.input"), 2, "none.input");
  expect_fails("run flight --engine bullet", 2, "only the native engine");
  expect_fails("compare ballistic", 2, "only the native engine");
  expect_fails("scenes flight --export", 2, "only the native engine");
  expect_fails("run flight --record " + folder.file("a.rec"), 2, "--record requires a scene");
  expect_fails("run flight --no-sleep", 2, "--no-sleep requires a scene");
  expect_fails("run flight --resolver worst-first", 2, "--resolver requires a scene");
  expect_fails("run flight --substeps 2", 2, "--substeps requires a scene");
  expect_fails("run pile --boxes 3", 2, "boxes");
  expect_fails("run flight --dt 0", 2, "dt");
}

TEST(Tool, DevicesReportsEveryBackend) {
  const ProcessResult result = jfpx_stdout("devices");
  EXPECT_EQ(result.status, 0);
  for (const BackendStatus& status : available_backends()) {
    EXPECT_THAT(result.output, HasSubstr(std::string(to_string(status.backend))));
    EXPECT_THAT(result.output, HasSubstr(status.usable ? status.device : status.reason));
  }
}

TEST(Tool, UnusableCudaIsStatusThreeWithTheReason) {
  if (cuda_usable()) GTEST_SKIP() << "CUDA is usable here";
  std::string reason;
  for (const BackendStatus& status : available_backends()) {
    if (status.backend == Backend::cuda) reason = status.reason;
  }
  expect_fails("run pile --steps 1 --backend cuda", 3, "cuda: " + reason);
  const std::string first = JFPX_HAS_BULLET ? "cuda: " + reason : "built without Bullet";
  expect_fails("compare pile --steps 1 --backend cuda", 3, first);
}

TEST(Tool, HashIsTheLastLineAndRepeats) {
  const std::string arguments = "run pile --spheres 50 --steps 20 --hash";
  const ProcessResult loud = jfpx_stdout(arguments);
  const ProcessResult quiet = jfpx_stdout(arguments + " --quiet");
  EXPECT_TRUE(is_hash(quiet.output)) << quiet.output;
  EXPECT_THAT(loud.output, ::testing::EndsWith("\n" + quiet.output));
  EXPECT_EQ(jfpx_stdout(arguments + " --quiet --threads 3").output, quiet.output);
  EXPECT_NE(jfpx_stdout(arguments + " --quiet --seed 2").output, quiet.output);
}

TEST(Tool, TheResolverAndItsSubstepsAreSelected) {
  const std::string arguments = "run pile --spheres 30 --steps 40 --quiet --hash --resolver ";
  const std::string worst_first = jfpx_stdout(arguments + "worst-first").output;
  const std::string soft_step = jfpx_stdout(arguments + "soft-step").output;
  EXPECT_TRUE(is_hash(soft_step)) << soft_step;
  EXPECT_NE(soft_step, worst_first);
  EXPECT_NE(jfpx_stdout(arguments + "soft-step --substeps 7").output, soft_step);
  EXPECT_EQ(jfpx_stdout(arguments + "soft-step --threads 3").output, soft_step);
  for (const std::string resolver : {"soft-step", "worst-first"}) {
    const std::string command = "run pile --spheres 3 --steps 1 --resolver " + resolver;
    EXPECT_EQ(nlohmann::json::parse(jfpx_stdout(command + " --json -").output)["resolver"],
              resolver);
    EXPECT_THAT(jfpx_stdout(command).output, HasSubstr("resolver " + resolver));
  }
}

/// The cells of a CSV file.
std::vector<std::vector<std::string>> read_csv(const std::string& path) {
  std::vector<std::vector<std::string>> rows;
  std::ifstream file(path);
  for (std::string line, cell; std::getline(file, line);) {
    std::istringstream cells(line);
    for (rows.emplace_back(); std::getline(cells, cell, ',');) rows.back().push_back(cell);
  }
  return rows;
}

/// A ball that begins 4 mm below the ground and another that flies at 3 m/s.
void save_two_balls(const std::string& path) {
  Scene scene;
  scene.bodies.resize(3);
  for (BodyDef& body : scene.bodies) {
    body.shape = Sphere{Real(0.5)};
    body.acceleration = {};
  }
  scene.bodies[0].position = {0, Real(0.496), 0};
  scene.bodies[1].position = {9, 9, 9};
  scene.bodies[1].velocity = {0, 3, 0};
  scene.bodies[2].shape = HalfSpace{{0, 1, 0}, 0};
  scene.bodies[2].mass = 0;
  save_scene(scene, path);
}

TEST(Tool, RunReportsPenetrationSpeedAndAwakeBodies) {
  const test::TemporaryFolder folder;
  save_two_balls(folder.file("balls.json"));
  for (const std::string engine :
       {"native --resolver soft-step", "native --resolver worst-first", "bullet", "bullet-stock"}) {
    if (!JFPX_HAS_BULLET && engine.starts_with("bullet")) continue;
    const std::string run = "run " + folder.file("balls.json") + " --steps 1 --engine " + engine;
    const auto json =
        nlohmann::json::parse(jfpx_stdout(run + " --json - --csv " + folder.file("a.csv")).output);
    EXPECT_NEAR(json["deepest_penetration"], 0.004, 1e-5) << engine;
    EXPECT_EQ(json["mean_penetration"], json["deepest_penetration"]) << engine;
    EXPECT_NEAR(json["largest_speed"], 3, 1e-5) << engine;
    EXPECT_EQ(json["awake"], 2) << engine;
    EXPECT_EQ(json["resolver"].is_null(), engine.starts_with("bullet"));
    const auto csv = read_csv(folder.file("a.csv"));
    ASSERT_EQ(csv.size(), 2u);
    // Columns of later versions follow those of the first one.
    EXPECT_THAT(csv[0],
                ::testing::ElementsAre("step", "contacts", "awake", "integrate_ms", "broad_ms",
                                       "detect_ms", "solve_ms", "total_ms", "deepest_penetration",
                                       "mean_penetration", "largest_speed"));
    ASSERT_EQ(csv[1].size(), csv[0].size());
    EXPECT_NEAR(std::stod(csv[1][8]), 0.004, 1e-5) << engine;
    EXPECT_NEAR(std::stod(csv[1][10]), 3, 1e-5) << engine;
    EXPECT_THAT(jfpx_stdout(run).output, HasSubstr("penetration at the end 0.004 m deepest"));
  }
  const auto none =
      nlohmann::json::parse(jfpx_stdout("run gas --spheres 0 --steps 1 --json -").output);
  for (const char* field : {"deepest_penetration", "mean_penetration", "largest_speed", "awake"}) {
    EXPECT_EQ(none[field], 0) << field;
  }
}

TEST(Tool, TheOldNameX86SelectsTheCpu) {
  const std::string arguments = "run pile --spheres 9 --steps 2 --quiet --json - --backend ";
  for (const std::string name : {"cpu", "x86"}) {
    EXPECT_EQ(nlohmann::json::parse(jfpx_stdout(arguments + name).output)["backend"], "cpu");
  }
}

TEST(Tool, PrecisionSwitchesTheBuild) {
  if (!JFPX_HAS_BOTH_PRECISIONS) GTEST_SKIP() << "built in one precision";
  const std::string arguments = "run gas --spheres 20 --steps 3 --json - --quiet --precision ";
  for (const std::string precision : {"float", "double"}) {
    const auto json = nlohmann::json::parse(jfpx_stdout(arguments + precision).output);
    EXPECT_EQ(json["precision"], precision);
  }
  EXPECT_EQ(
      jfpx_stdout("run gas --steps 1 --quiet --hash --precision=" + std::string(kOtherPrecision))
          .status,
      0);
}

TEST(Tool, RunWritesCsvAndJson) {
  const test::TemporaryFolder folder;
  const ProcessResult result =
      jfpx_command("run pile --spheres 20 --steps 7 --csv " + folder.file("a.csv") + " --json " +
                   folder.file("a.json"));
  ASSERT_EQ(result.status, 0) << result.output;
  std::ifstream csv(folder.file("a.csv"));
  std::string line;
  int lines = 0;
  while (std::getline(csv, line)) ++lines;
  EXPECT_EQ(lines, 8);
  const auto json = nlohmann::json::parse(std::ifstream(folder.file("a.json")));
  EXPECT_EQ(json["scene"], "pile");
  EXPECT_EQ(json["steps"], 7);
  EXPECT_EQ(folder.entries(), 2u);
}

TEST(Tool, UnwritableOutputFailsBeforeTheRunAndLeavesNothing) {
  const test::TemporaryFolder folder;
  expect_fails("run pile --steps 1 --json " + folder.file("no/x.json"), 2, "can't be written");
  expect_fails("run pile --steps 1 --csv " + folder.file("no/x.csv"), 2, "can't be written");
  expect_fails("run pile --steps 1 --record " + folder.file("no/x.rec"), 2, "can't be written");
  EXPECT_EQ(folder.entries(), 0u);
}

TEST(Tool, ReplayFindsARecordingEqual) {
  if (!JFPX_HAS_BOTH_PRECISIONS) GTEST_SKIP() << "built in one precision";
  const test::TemporaryFolder folder;
  const std::string path = folder.file("run.rec");
  for (const std::string precision : {"float", "double"}) {
    ASSERT_EQ(jfpx_command("run pile --spheres 60 --steps 40 --quiet --record " + path +
                           " --precision " + precision)
                  .status,
              0);
    const ProcessResult result = jfpx_command("replay " + path);
    EXPECT_EQ(result.status, 0) << result.output;
    EXPECT_THAT(result.output, HasSubstr("40 steps"));
    EXPECT_THAT(result.output, HasSubstr("bit for bit"));
  }
}

TEST(Tool, ReplayUsesTheRecordedResolver) {
  const test::TemporaryFolder folder;
  const std::string path = folder.file("run.rec");
  for (const Solver solver : {Solver::soft_step, Solver::worst_first}) {
    const std::string resolver = solver == Solver::soft_step ? "soft-step" : "worst-first";
    const std::string record = "run pile --spheres 40 --steps 50 --threads 2 --quiet --record ";
    ASSERT_EQ(jfpx_command(record + path + " --resolver " + resolver).status, 0);
    EXPECT_EQ(RecordingReader(path).header().scene.solver, solver);
    for (const std::string threads : {"1", "3"}) {
      const ProcessResult result = jfpx_command("replay --threads " + threads + " " + path);
      EXPECT_EQ(result.status, 0) << result.output;
      EXPECT_THAT(result.output, HasSubstr("50 steps"));
    }
  }
}

/// Rewrites a recording of Solver::worst_first as one of version 0.1, whose scenes have no solver.
void rewrite_as_version_0_1(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  std::string bytes(std::istreambuf_iterator<char>(file), {});
  constexpr std::size_t kPrefix = 24, kTrailer = 24, kHeaderSize = 16;
  std::uint64_t size = 0, frames = 0;
  std::memcpy(&size, &bytes[kHeaderSize], sizeof size);
  std::memcpy(&frames, &bytes[bytes.size() - kTrailer], sizeof frames);
  auto header = nlohmann::ordered_json::parse(bytes.substr(kPrefix, size));
  ASSERT_EQ(header["scene"]["solver"], "worst_first");
  header["backend"] = "x86";
  header["scene"]["jfpx_scene"] = 1;
  for (const char* field : {"solver", "soft_step"}) header["scene"].erase(field);
  for (const char* field : {"speed", "time"}) header["scene"]["sleep"].erase(field);
  const std::string text = header.dump();
  const std::string states = bytes.substr(kPrefix + size, bytes.size() - kPrefix - size - kTrailer);
  size = text.size();
  std::memcpy(&bytes[kHeaderSize], &size, sizeof size);
  Hash64 hash;
  hash.add_bytes(bytes.data(), kPrefix);
  hash.add_bytes(text.data(), text.size());
  const std::size_t frame = states.size() / frames;
  for (std::uint64_t i = 0; i < frames; ++i) hash.add_bytes(&states[i * frame], frame);
  hash.add_word(frames);
  const std::uint64_t checksum = hash.value();
  std::string trailer = bytes.substr(bytes.size() - kTrailer);
  std::memcpy(&trailer[sizeof frames], &checksum, sizeof checksum);
  std::ofstream(path, std::ios::binary) << bytes.substr(0, kPrefix) << text << states << trailer;
}

TEST(Tool, ReplayOfVersion01ResolvesWorstFirst) {
  const test::TemporaryFolder folder;
  const std::string path = folder.file("old.rec");
  ASSERT_EQ(jfpx_command(
                "run pile --spheres 40 --steps 50 --quiet --resolver worst-first --record " + path)
                .status,
            0);
  rewrite_as_version_0_1(path);
  EXPECT_EQ(RecordingReader(path).header().scene.solver, Solver::worst_first);
  const ProcessResult result = jfpx_command("replay " + path);
  EXPECT_EQ(result.status, 0) << result.output;
  EXPECT_THAT(result.output, HasSubstr("bit for bit"));
}

TEST(Tool, ReplayRepeatsForcesAndChangesOfBodies) {
  const test::TemporaryFolder folder;
  const std::string path = folder.file("run.rec");
  RecordedWorld world(path, scenes::make("pile", {.spheres = 20}));
  world.add_force(Drag{.linear = Real(0.5)});
  for (int step = 0; step < 20; ++step) {
    if (step == 5) world.remove(world.world().bodies()[3]);
    if (step == 7) world.add(BodyDef());
    if (step == 9) world.apply_force(world.world().bodies()[4], {50, 0, 0});
    world.step();
  }
  world.finish();
  const ProcessResult result = jfpx_command("replay " + path);
  EXPECT_EQ(result.status, 0) << result.output;
  EXPECT_THAT(result.output, HasSubstr("bit for bit"));
  expect_fails("replay --engine " + std::string(JFPX_HAS_BULLET ? "bullet " : "native --x ") + path,
               2, JFPX_HAS_BULLET ? "only the native engine repeats" : "--x");
}

TEST(Tool, ReplayContinuesFromASnapshot) {
  const test::TemporaryFolder folder;
  const std::string recording = folder.file("run.rec"), snapshot = folder.file("half.snap");
  for (const std::string resolver : {"soft-step", "worst-first"}) {
    const std::string run = "run pile --spheres 40 --quiet --resolver " + resolver;
    ASSERT_EQ(jfpx_command(run + " --steps 50 --record " + recording).status, 0);
    ASSERT_EQ(jfpx_command(run + " --steps 30 --threads 2 --snapshot " + snapshot).status, 0);
    for (const std::string threads : {"1", "3"}) {
      const ProcessResult result =
          jfpx_command("replay --threads " + threads + " --from " + snapshot + " " + recording);
      EXPECT_EQ(result.status, 0) << result.output;
      EXPECT_THAT(result.output, HasSubstr("20 steps after step 30, engine native: all states"));
    }
  }
  if (!JFPX_HAS_BULLET) return;
  expect_fails("replay --engine bullet-stock --from " + snapshot + " " + recording, 2,
               "--from requires the native engine; engine is bullet-stock");
}

TEST(Tool, ReplayFindsADifferenceToTheSnapshot) {
  const test::TemporaryFolder folder;
  const std::string recording = folder.file("run.rec"), snapshot = folder.file("other.snap");
  const std::string run = "run pile --spheres 40 --quiet --steps ";
  ASSERT_EQ(jfpx_command(run + "20 --record " + recording).status, 0);
  const std::string replay = "replay --from " + snapshot + " " + recording;
  ASSERT_EQ(jfpx_command(run + "10 --seed 2 --snapshot " + snapshot).status, 0);
  expect_fails(replay, 1, "step 10, body ");
  ASSERT_EQ(jfpx_command(run + "21 --snapshot " + snapshot).status, 0);
  expect_fails(replay, 2, "snapshot is of step 21; it must be of step 0 to 20 of the recording");
  std::ofstream(snapshot) << "no snapshot at all, only text of some length";
  expect_fails(replay, 2, "other.snap: this is not a snapshot of jfpx");
  expect_fails(replay + "x", 2, "run.recx");
}

TEST(Tool, SnapshotsAreOfNativeScenes) {
  const test::TemporaryFolder folder;
  const std::string option = " --steps 1 --snapshot " + folder.file("x.snap");
  expect_fails("run pile --engine bullet-stock" + option, 2, "--snapshot requires --engine native");
  expect_fails("run flight" + option, 2, "--snapshot requires a scene");
  expect_fails("run pile --steps 1 --snapshot " + folder.file("no/x.snap"), 2, "can't be written");
  EXPECT_EQ(folder.entries(), 0u);
}

TEST(Tool, ReplayStopsAtTheFirstStepThatDiffers) {
  const test::TemporaryFolder folder;
  const std::string path = folder.file("run.rec");
  ASSERT_EQ(jfpx_command("run pile --spheres 10 --steps 8 --quiet --record " + path).status, 0);
  const std::string changed = folder.file("changed.rec");
  {
    RecordingReader reader(path);
    RecordingWriter writer(changed, reader.header());
    for (std::uint64_t step = 1; step <= reader.steps(); ++step) {
      auto states = reader.states(step);
      if (step == 5) states[3].velocity.y = Real(42);
      writer.append(states);
    }
    writer.finish();
  }
  expect_fails("replay " + changed, 1, "step 5, body 3, velocity.y: recorded 42");
}

TEST(Tool, ReplayRefusesDamagedFiles) {
  const test::TemporaryFolder folder;
  std::ofstream(folder.file("x.rec")) << "no recording at all, only text of some length";
  expect_fails("replay " + folder.file("x.rec"), 2, "is not a jfpx recording");
  expect_fails("replay " + folder.file("missing.rec"), 2, "missing.rec");
}

#if JFPX_HAS_BULLET
TEST(Tool, CompareFindsEveryNamedSceneIdentical) {
  for (const scenes::Entry& entry : scenes::all()) {
    if (!scenes::make(entry.name).joints.empty()) {  // not supported in Bullet
      expect_fails("compare " + std::string(entry.name), 2, "joints");
      continue;
    }
    for (const char* sleep : {"", " --no-sleep"}) {
      const ProcessResult result =
          jfpx_stdout("compare " + std::string(entry.name) +
                      " --spheres 125 --steps 30 --quiet --json -" + sleep);
      EXPECT_EQ(result.status, 0) << entry.name << "\n" << result.output;
      const auto json = nlohmann::json::parse(result.output);
      EXPECT_EQ(json["contact_mismatches"], 0) << entry.name;
      EXPECT_EQ(json["trajectory_identical"], true) << entry.name;
      EXPECT_TRUE(json["first_difference"].is_null());
      EXPECT_EQ(json["hash_stock"], json["hash_jfpx"]);
      EXPECT_EQ(json["spheres"], 125);
      EXPECT_TRUE(json["ms"].contains("native"));
    }
  }
}

TEST(Tool, CompareReallyComparesContacts) {
  const auto json = nlohmann::json::parse(
      jfpx_stdout("compare overlap --spheres 100 --steps 1 --quiet --json -").output);
  EXPECT_EQ(json["contacts_compared"], 100 * 99 / 2);
  EXPECT_EQ(json["batches"], 1) << "by default jfpx computes every dispatch";
}

TEST(Tool, CompareReportsTroubleOfTheNativeWorld) {
  const test::TemporaryFolder folder;
  const std::string path = folder.file("scene.json");
  save_runaway(path);
  expect_fails("compare " + path + " --steps 3", 1, "body 1 became non-finite");
  const auto troubled =
      nlohmann::json::parse(jfpx_stdout("compare " + path + " --steps 3 --json -").output);
  EXPECT_NE(troubled["trouble"], "");
  const auto fine = nlohmann::json::parse(jfpx_stdout("compare pile --steps 1 --json -").output);
  EXPECT_EQ(fine["trouble"], "");
  EXPECT_TRUE(fine["device_failure"].is_string());
}

TEST(Tool, CompareUsesTheJfpxSolverByDefault) {
  const std::string arguments = "compare pile --spheres 60 --steps 40 --quiet --json - ";
  const auto ours = nlohmann::json::parse(jfpx_stdout(arguments).output);
  const auto stock = nlohmann::json::parse(jfpx_stdout(arguments + "--solver stock").output);
  EXPECT_GE(ours["groups"], 20);
  EXPECT_EQ(stock["groups"], 0);
  EXPECT_LE(ours["groups_on_device"], ours["groups"]);
  EXPECT_EQ(stock["groups_on_device"], 0);
  EXPECT_EQ(ours["hash_jfpx"], stock["hash_jfpx"]);
}

TEST(Tool, CompareRunsTheSelectedResolver) {
  const std::string arguments = "pile --spheres 40 --steps 30 --quiet --resolver worst-first ";
  const auto json = nlohmann::json::parse(jfpx_stdout("compare --json - " + arguments).output);
  EXPECT_EQ(json["resolver"], "worst-first");
  EXPECT_EQ(json["hash_native"].get<std::string>() + "\n",
            jfpx_stdout("run --hash " + arguments).output);
}

TEST(Tool, BulletEnginesRunAndAgree) {
  const std::string arguments = "run pile --spheres 80 --steps 60 --quiet --hash --engine ";
  const ProcessResult jfpx = jfpx_stdout(arguments + "bullet");
  const ProcessResult stock = jfpx_stdout(arguments + "bullet-stock");
  EXPECT_EQ(jfpx.output, jfpx_stdout(arguments + "bullet --world stock --solver stock").output);
  EXPECT_EQ(jfpx.status, 0);
  EXPECT_EQ(jfpx.output, stock.output);
  EXPECT_NE(jfpx.output, jfpx_stdout(arguments + "native").output);
}

TEST(Tool, ScenesOfNoneAndOneBodyWork) {
  for (const char* spheres : {"0", "1"}) {
    EXPECT_EQ(jfpx_command(std::string("compare pile --steps 3 --spheres ") + spheres).status, 0);
    EXPECT_EQ(jfpx_command(std::string("run overlap --steps 3 --spheres ") + spheres).status, 0);
  }
}
#else
TEST(Tool, BulletThatIsNotBuiltInIsStatusThree) {
  expect_fails("compare pile", 3, "built without Bullet");
  expect_fails("run pile --engine bullet", 3, "built without Bullet");
}
#endif

}  // namespace
}  // namespace jfpx
