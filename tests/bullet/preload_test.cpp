/// Unmodified programs with and without the preloaded library.
#include <jfpx/backend.hpp>

#include "src/base/sanitizers.hpp"
#include "tests/support/environment.hpp"
#include "tests/support/process.hpp"
#include "tests/support/temporary_folder.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <string>
#include <thread>

namespace jfpx {
namespace {

using test::EnvironmentVariable;
using test::ProcessResult;
using test::run_process;
using ::testing::ContainsRegex;
using ::testing::HasSubstr;
using ::testing::Not;

class Preload : public ::testing::Test {
 protected:
  static ProcessResult jfpx_command(const std::string& arguments) {
    return run_process(JFPX_TOOL_PATH " " + arguments);
  }
  static ProcessResult alone(const std::string& arguments) {
    return run_process(JFPX_STOCK_PROGRAM " " + arguments);
  }

 private:
  // For sanitizer builds, whose run-time library must otherwise be the first of a program.
  const EnvironmentVariable asan_options_{"ASAN_OPTIONS",
                                          "verify_asan_link_order=0:detect_leaks=0"};
};

/// Whether the program of environment_program.cpp prints the same with all parts of jfpx.
void expect_equal_output(const std::string& arguments, const std::string& options = "") {
  const std::string program = JFPX_ENVIRONMENT_PROGRAM " " + arguments;
  const ProcessResult stock = run_process(program);
  ASSERT_EQ(stock.status, 0) << arguments;
  const ProcessResult ours =
      run_process(JFPX_TOOL_PATH " preload --minimum-batch 0 " + options + " -- " + program);
  EXPECT_EQ(ours.status, 0) << arguments;
  EXPECT_EQ(ours.output, stock.output) << arguments << options;
}

constexpr const char* kPrecision = sizeof(Real) == 4 ? "Bullet in float" : "Bullet in double";

TEST_F(Preload, KeepsTheHashAndRunsBatches) {
  const ProcessResult stock = alone("300");
  ASSERT_EQ(stock.status, 0);
  ASSERT_EQ(stock.output.size(), 17u);
  const ProcessResult ours = jfpx_command(
      "preload --summary --verify --minimum-batch 0 -- " JFPX_STOCK_PROGRAM " 300 2>&1");
  EXPECT_EQ(ours.status, 0);
  EXPECT_THAT(ours.output, HasSubstr(stock.output));
  EXPECT_THAT(ours.output, ContainsRegex(std::string(kPrecision) + ": 60 dispatches, 60 batches"));
  EXPECT_THAT(ours.output, ContainsRegex("[1-9][0-9]* touching, [1-9][0-9]* written"));
  EXPECT_THAT(ours.output, ContainsRegex("verified: [1-9][0-9]* pairs, 0 mismatches\n"));
  EXPECT_THAT(ours.output, HasSubstr(": world: 60 AABB updates\n"));
  // In three of the sixty steps, rows are in random order, which is left to Bullet.
  EXPECT_THAT(ours.output,
              ContainsRegex(": solver: 114 groups, [1-9][0-9]* contacts, 57 joints\n"));
  EXPECT_THAT(ours.output, HasSubstr(": groups left to Bullet: 6 (solver mode)\n"));
}

TEST_F(Preload, OptionsTakePrecedenceOverTheEnvironment) {
  const std::string with_variable = "JFPX_PRELOAD_BACKEND=cpu " JFPX_TOOL_PATH " preload ";
  const std::string shows = "-- printenv JFPX_PRELOAD_BACKEND";
  EXPECT_EQ(run_process(with_variable + "--backend auto " + shows).output, "auto\n");
  EXPECT_EQ(run_process(with_variable + shows).output, "cpu\n");
}

TEST_F(Preload, ArgumentsAfterTheProgramAreItsOwn) {
  const std::string echo = "preload --threads 2 --backend=cpu --parts solver ";
  for (const std::string separator : {"", "-- "}) {
    const ProcessResult result =
        jfpx_command(echo + separator + "echo --summary run --precision half -- -x 2>&1");
    EXPECT_EQ(result.output, "--summary run --precision half -- -x\n");
  }
  EXPECT_EQ(jfpx_command("preload run --help 2>&1").status, 2) << "no program is called run";
  EXPECT_THAT(jfpx_command("preload --sumary echo 2>&1").output, HasSubstr("--sumary"));
  EXPECT_EQ(jfpx_command("preload 2>&1").status, 2);
  EXPECT_THAT(jfpx_command("preload --help").output,
              HasSubstr("jfpx preload [OPTIONS] PROGRAM [ARGS]"));
}

TEST_F(Preload, EnablesOnlyTheRequestedParts) {
  const std::string stock = alone("300").output;
  const auto with = [&](const std::string& options) {
    const ProcessResult ours =
        jfpx_command("preload --summary " + options + " -- " JFPX_STOCK_PROGRAM " 300 2>&1");
    EXPECT_THAT(ours.output, HasSubstr(stock)) << options;
    return ours.output;
  };
  const std::string solver = with("--parts solver --threads 3 --minimum-batch 0");
  EXPECT_THAT(solver, HasSubstr(": solver: 114 groups"));
  EXPECT_THAT(solver, Not(HasSubstr("AABB updates")));
  EXPECT_THAT(solver, HasSubstr(": 0 dispatches"));
  const std::string others = with("--parts world,dispatcher --threads 0 --minimum-batch 0");
  EXPECT_THAT(others, Not(HasSubstr(": solver: ")));
  EXPECT_THAT(others, HasSubstr(": world: 60 AABB updates"));
  EXPECT_THAT(others, HasSubstr(": 60 dispatches, 60 batches"));
  EXPECT_EQ(jfpx_command("preload --parts islands -- echo 2>&1").status, 2);
  EXPECT_EQ(jfpx_command("preload --threads 257 -- echo 2>&1").status, 2);
}

TEST_F(Preload, ReportsInvalidSettingsAndIgnoresThem) {
  const std::string stock = alone("300").output;
  const EnvironmentVariable threads("JFPX_PRELOAD_THREADS", "300");
  const EnvironmentVariable backend("JFPX_PRELOAD_BACKEND", "gpu");
  const EnvironmentVariable minimum("JFPX_PRELOAD_MINIMUM_BATCH", "-1");
  const ProcessResult ours = jfpx_command("preload -- " JFPX_STOCK_PROGRAM " 300 2>&1");
  EXPECT_EQ(ours.status, 0);
  EXPECT_THAT(ours.output, HasSubstr(stock));
  EXPECT_THAT(ours.output, HasSubstr("JFPX_PRELOAD_THREADS is \"300\"; it must be 0 to 256."));
  EXPECT_THAT(ours.output, HasSubstr("JFPX_PRELOAD_BACKEND is \"gpu\"; it must be auto, cpu or "));
  EXPECT_THAT(ours.output, HasSubstr("JFPX_PRELOAD_MINIMUM_BATCH is \"-1\"; it must be a whole "));
}

TEST_F(Preload, ReportsAMissingGpuAndLeavesEverythingToBullet) {
  if (available_backends()[1].usable) GTEST_SKIP() << "a GPU is usable";
  const EnvironmentVariable backend("JFPX_PRELOAD_BACKEND", "cuda");
  const ProcessResult ours =
      jfpx_command("preload --summary --minimum-batch 0 -- " JFPX_STOCK_PROGRAM " 300 2>&1");
  EXPECT_EQ(ours.status, 0);
  EXPECT_THAT(ours.output, HasSubstr(alone("300").output));
  EXPECT_THAT(ours.output, HasSubstr(": 0 dispatches, 0 batches (none)\n"));
  EXPECT_THAT(ours.output, ContainsRegex(": failed: cuda: [^\n]+\n"));
  EXPECT_THAT(ours.output, ContainsRegex(": solver: failed: cuda: [^\n]+\n"));
}

TEST_F(Preload, DetectsThePrecisionOfTheProgram) {
  if (!JFPX_HAS_BOTH_PRECISIONS) GTEST_SKIP() << "built in one precision";
  const ProcessResult result =
      jfpx_command("preload --summary --minimum-batch 0 -- " JFPX_OTHER_STOCK_PROGRAM " 50 2>&1");
  EXPECT_THAT(result.output, HasSubstr(run_process(JFPX_OTHER_STOCK_PROGRAM " 50").output));
  EXPECT_THAT(result.output, HasSubstr("60 batches (cpu)"));
  EXPECT_THAT(result.output, Not(HasSubstr(kPrecision)));
}

TEST_F(Preload, SupportsWorldsInSeveralThreads) {
  const std::string sizes = "200 100 0 1 150 200";
  const ProcessResult ours = jfpx_command(
      "preload --summary --minimum-batch 0 -- " JFPX_STOCK_PROGRAM " " + sizes + " 2>&1");
  EXPECT_THAT(ours.output, HasSubstr(alone(sizes).output));
  EXPECT_THAT(ours.output, HasSubstr("360 dispatches, "));
}

TEST_F(Preload, LeavesSmallWorldsToBulletByDefault) {
  const ProcessResult ours = jfpx_command("preload --summary -- " JFPX_STOCK_PROGRAM " 20 2>&1");
  EXPECT_THAT(ours.output, HasSubstr(alone("20").output));
  EXPECT_THAT(ours.output, HasSubstr("60 dispatches, 0 batches"));
  EXPECT_THAT(ours.output, HasSubstr("left to Bullet: 60 (small batch)"));
}

TEST_F(Preload, IsSilentAndKeepsTheExitStatusOfTheProgram) {
  const ProcessResult silent = jfpx_command("preload -- " JFPX_STOCK_PROGRAM " 30 2>&1");
  EXPECT_EQ(silent.output, alone("30").output);
  EXPECT_EQ(jfpx_command("preload -- " JFPX_STOCK_PROGRAM).status, 7);
}

TEST_F(Preload, LeavesProgramsWithoutBulletUntouched) {
  const ProcessResult result = jfpx_command(
      "preload --summary -- sh -c 'echo \"$@\"; exit 5' -- --precision double -- x 2>&1");
  EXPECT_EQ(result.status, 5);
  EXPECT_EQ(result.output, "--precision double -- x\n");
}

TEST_F(Preload, ReportsThatBulletWasNotUsed) {
  const ProcessResult result = jfpx_command("preload --summary -- " JFPX_STOCK_PROGRAM " 2>&1");
  EXPECT_THAT(result.output, HasSubstr(": no shared library of Bullet was used\n"));
}

TEST_F(Preload, KeepsOtherPreloadedLibraries) {
  const ProcessResult result = run_process("LD_PRELOAD=libm.so.6 " JFPX_TOOL_PATH
                                           " preload -- sh -c 'echo $LD_PRELOAD' 2>&1");
  EXPECT_THAT(result.output, HasSubstr("libjfpx-bullet-preload.so:libm.so.6"));
}

TEST_F(Preload, ReportsWhyAProgramDoesNotStart) {
  const ProcessResult missing = jfpx_command("preload -- /nowhere/at-all --x 2>&1");
  EXPECT_EQ(missing.status, 2);
  EXPECT_EQ(missing.output,
            "jfpx: \"/nowhere/at-all\" can't be started: No such file or directory\n");
  EXPECT_EQ(jfpx_command("preload -- / 2>&1").status, 2);
  EXPECT_EQ(jfpx_command("preload 2>&1").status, 2);
  EXPECT_EQ(jfpx_command("preload --minimum-batch -1 -- echo 2>&1").status, 2);
  EXPECT_EQ(jfpx_command("preload --backend abacus -- echo 2>&1").status, 2);
}

TEST_F(Preload, LeavesAnUnsupportedBulletUnchanged) {
  // The same library under the name of another version, as a distribution may ship it.
  const test::TemporaryFolder folder;
  const std::string library = folder.file("libBulletCollision-9.so");
  const ProcessResult copied = run_process("cp -L " JFPX_BULLET_COLLISION " " + library + " 2>&1");
  ASSERT_EQ(copied.status, 0) << copied.output;
  // Listed before the program's own library, it takes precedence in symbol lookup.
  const ProcessResult result =
      run_process("LD_PRELOAD=" + library +
                  " " JFPX_TOOL_PATH " preload --summary -- " JFPX_STOCK_PROGRAM " 30 2>&1");
  EXPECT_THAT(result.output, HasSubstr(alone("30").output));
  EXPECT_THAT(result.output, HasSubstr("left to Bullet: " + library + " is neither"));
}

TEST_F(Preload, HoldsNoMemoryOfBulletsAllocatorBetweenWorlds) {
  for (const char* options : {"", "--threads 2"}) expect_equal_output("allocators", options);
}

TEST_F(Preload, RunsWithFloatingPointTraps) {
  for (const char* options : {"", "--threads 2"}) {
    expect_equal_output("traps 300", options);
    expect_equal_output("flags 300", options);
  }
}

TEST_F(Preload, KeepsTheHashInEveryRoundingMode) {
  expect_equal_output("rounding 200");
  const ProcessResult ours = jfpx_command(
      "preload --summary --minimum-batch 0 -- " JFPX_ENVIRONMENT_PROGRAM " rounding 100 2>&1");
  EXPECT_THAT(ours.output, HasSubstr("left to Bullet: 180 (rounding mode)\n"));
  EXPECT_THAT(ours.output, ContainsRegex("groups left to Bullet: [1-9][0-9]* \\(rounding mode\\)"));
}

TEST_F(Preload, ReportsUnknownPartsAndIgnoresThem) {
  const std::string command =
      JFPX_TOOL_PATH " preload --summary -- " JFPX_STOCK_PROGRAM " 300 2>&1";
  const ProcessResult unknown = run_process("JFPX_PRELOAD_PARTS=solver,wheels " + command);
  EXPECT_THAT(
      unknown.output,
      HasSubstr("jfpx preload: JFPX_PRELOAD_PARTS is \"solver,wheels\"; it must be a list of "
                "dispatcher, solver and world. The value is ignored.\n"));
  EXPECT_THAT(unknown.output, HasSubstr("60 dispatches"));
  EXPECT_THAT(unknown.output, HasSubstr("60 AABB updates"));
}

TEST_F(Preload, ReportsThatTheSummaryOfAProgramIsEmpty) {
  const std::string preload = "preload --summary -- ";
  // It closes stderr at exit.
  EXPECT_EQ(jfpx_command(preload + "ls /dev/null 2>&1").output,
            "/dev/null\njfpx preload: ls: no shared library of Bullet was used\n");
  EXPECT_THAT(jfpx_command(preload + JFPX_ENVIRONMENT_PROGRAM " name 2>&1").output,
              HasSubstr(": left to Bullet, which is statically linked in the program\n"));
}

TEST_F(Preload, ReportsProgramsIntoWhichItCannotBeLoaded) {
  const test::TemporaryFolder folder;
  const std::string echo = folder.file("echo");
  if (run_process("cp /bin/echo " + echo + " && chown 65534 " + echo + " && chmod 4755 " + echo)
          .status == 0) {
    EXPECT_EQ(jfpx_command("preload -- " + echo + " x 2>&1").output,
              "jfpx preload: " + echo +
                  " runs with the rights of another user or group, so that LD_PRELOAD is ignored; "
                  "it runs without jfpx\nx\n");
  }
  const std::string is_static = "head -c 4 /sbin/ldconfig | grep -q ELF && ! ldd /sbin/ldconfig";
  if (run_process("(" + is_static + ") > " + folder.file("output") + " 2>&1").status == 0) {
    EXPECT_THAT(jfpx_command("preload -- /sbin/ldconfig --version 2>&1").output,
                ContainsRegex("^jfpx preload: /sbin/ldconfig is statically linked; it runs without "
                              "jfpx\nldconfig"));
  }
}

TEST_F(Preload, ReportsBulletInAnotherPrecisionUnderAKnownName) {
  if (!JFPX_HAS_BOTH_PRECISIONS) GTEST_SKIP() << "built in one precision";
  // As a program may have built it: the name of the library does not contain the precision.
  const test::TemporaryFolder folder;
  const auto renamed = [&](const std::string& path) {
    std::string name = path.substr(path.rfind('/') + 1);
    const std::size_t suffix = name.find("-float64");
    if (suffix == std::string::npos) {
      name.insert(name.find(".so"), "-float64");
    } else {
      name.erase(suffix, 8);
    }
    return folder.file(name);
  };
  std::string preload;
  for (const std::string part : {JFPX_BULLET_COLLISION, JFPX_BULLET_DYNAMICS}) {
    const std::string real = run_process("readlink -f " + part + " | xargs echo -n").output;
    ASSERT_EQ(run_process("cp " + real + " " + renamed(real)).status, 0);
    preload += (preload.empty() ? "" : ":") + renamed(real);
  }
  const ProcessResult result =
      run_process("LD_PRELOAD=" + preload +
                  " " JFPX_TOOL_PATH " preload --summary -- " JFPX_STOCK_PROGRAM " 30 2>&1");
  EXPECT_THAT(result.output, HasSubstr(alone("30").output));
  EXPECT_THAT(result.output,
              ContainsRegex(sizeof(Real) == 4 ? ": left to Bullet: [^ ]+ is Bullet in float, and "
                                                "jfpx was built with Bullet in double under "
                                              : ": left to Bullet: [^ ]+ is Bullet in double, and "
                                                "jfpx was built with Bullet in float under "));
}

TEST_F(Preload, StartsProgramsWithAddressSanitizer) {
#if defined(JFPX_ASAN_PROGRAM)
  const ProcessResult result = run_process("env -u ASAN_OPTIONS " JFPX_TOOL_PATH
                                           " preload --summary -- " JFPX_ASAN_PROGRAM " 300 2>&1");
  EXPECT_EQ(result.status, 0);
  EXPECT_THAT(result.output, HasSubstr(alone("300").output));
  EXPECT_THAT(result.output, HasSubstr("60 AABB updates"));
#else
  GTEST_SKIP() << "no program with AddressSanitizer";
#endif
}

TEST_F(Preload, StartsNoMoreThreadsForSeveralWorlds) {
  const std::string program = JFPX_ENVIRONMENT_PROGRAM " threads 8";
  const auto threads_of = [](const ProcessResult& result) {
    EXPECT_EQ(result.status, 0);
    return std::stol(result.output);
  };
  const long ours =
      threads_of(jfpx_command("preload --minimum-batch 0 --threads 64 -- " + program));
  const long workers = std::max(64l, static_cast<long>(std::thread::hardware_concurrency())) - 1;
  EXPECT_GT(ours, threads_of(run_process(program)));
  EXPECT_LE(ours, 9 + workers) << "the threads of the program, and those of the largest pool";
}

TEST_F(Preload, TakesLittleMoreStackThanBullet) {
  if (kAddressSanitizer || kThreadSanitizer) GTEST_SKIP() << "sanitizers enlarge stack frames";
  const std::string program = JFPX_ENVIRONMENT_PROGRAM " stack 300";
  const ProcessResult stock = run_process(program);
  const std::size_t hash_size = stock.output.find('\n') + 1;
  const auto bytes_of = [&](const ProcessResult& result) {
    EXPECT_EQ(result.status, 0);
    EXPECT_EQ(result.output.substr(0, hash_size), stock.output.substr(0, hash_size));
    return std::stoi(result.output.substr(hash_size));
  };
  for (const std::string threads : {"1", "2"}) {
    const std::string command = "preload --minimum-batch 0 --threads " + threads;
    const ProcessResult ours = jfpx_command(command + " -- " + program);
    EXPECT_LE(bytes_of(ours), bytes_of(stock) + 4096) << threads << " threads";
    EXPECT_THAT(jfpx_command(command + " --summary -- " + program + " 2>&1").output,
                HasSubstr("solver: "))
        << "jfpx has computed";
  }
}

}  // namespace
}  // namespace jfpx
