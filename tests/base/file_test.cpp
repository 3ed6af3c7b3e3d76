/// Files by name: names in UTF-8, replacement, and errors.
#include "src/base/file.hpp"

#include <jfpx/error.hpp>

#include "src/base/atomic_file.hpp"
#include "src/base/system.hpp"
#include "tests/support/environment.hpp"
#include "tests/support/temporary_folder.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <limits>
#include <optional>
#include <string>
#include <thread>

namespace jfpx {
namespace {

using ::testing::HasSubstr;

std::string error_of_reading(const std::string& path) {
  try {
    read_file(path);
  } catch (const FileError& error) {
    return error.what();
  }
  return "no error";
}

TEST(File, IsReadBackByEveryKindOfName) {
  const test::TemporaryFolder folder;
  const std::string content("line\r\nline\n\0\x1a end", 18);  // Ctrl-Z ends a text of Windows
  std::size_t files = 0;
  for (const char* name :
       {"plain", "with spaces.json", "gr\u00f6\u00dfe", "\u7403", "\U0001F3B1.obj", ".dot"}) {
    const std::string path = folder.file(name);
    write_file(path, "old, and longer than the new content");
    write_file(path, content);
    EXPECT_EQ(read_file(path), content) << name;
    EXPECT_TRUE(std::filesystem::exists(to_path(path))) << name;
    EXPECT_EQ(to_text(to_path(path)), path);
    EXPECT_EQ(folder.entries(), ++files) << name;
  }
}

TEST(File, ErrorsNameTheFileAndTheReason) {
  const test::TemporaryFolder folder;
  const std::string missing = folder.file("gr\u00f6\u00dfe");
  EXPECT_THAT(error_of_reading(missing), HasSubstr(missing + ": can't be opened: No such file"));
  EXPECT_THROW(write_file(folder.file("no/such/folder"), ""), FileError);
  std::filesystem::create_directory(to_path(folder.file("folder")));
  EXPECT_NE(error_of_reading(folder.file("folder")), "no error");
  EXPECT_THROW(write_file(folder.file("folder"), ""), FileError);
}

TEST(File, AnOpenFileIsReplacedOrKept) {
  const test::TemporaryFolder folder;
  const std::string path = folder.file("file");
  write_file(path, "old");
  std::FILE* const reader = open_file(path, "rb");
  ASSERT_NE(reader, nullptr);
  std::string content = "new";
  try {
    write_file(path, content);
  } catch (const FileError& error) {  // Windows
    EXPECT_THAT(error.what(), HasSubstr("file: can't be written: Permission denied"));
    content = "old";
  }
  std::fclose(reader);
  EXPECT_EQ(read_file(path), content);
  EXPECT_EQ(folder.entries(), 1u);
}

TEST(System, TheCacheFolderIsThatOfTheUser) {
  const test::TemporaryFolder folder;
  const test::EnvironmentVariable home("HOME", std::nullopt);
  {
    const test::EnvironmentVariable cache(test::kCacheVariable, folder.file("cache"));
    EXPECT_EQ(to_text(cache_folder()), folder.file("cache"));
  }
  for (const std::optional<std::string>& value : {std::optional<std::string>("relative"), {}}) {
    const test::EnvironmentVariable cache(test::kCacheVariable, value);
    EXPECT_TRUE(cache_folder().empty());
  }
}

#if !defined(_WIN32)
TEST(System, KnowsTheQuotasOfItsControlGroups) {
  const test::TemporaryFolder folder;
  const std::string root = folder.file(".");
  const auto write = [&](const std::string& path, const std::string& text) {
    const std::filesystem::path file = root + '/' + path;
    std::filesystem::create_directories(file.parent_path());
    std::ofstream(file) << text;
  };
  constexpr unsigned kUnlimited = std::numeric_limits<unsigned>::max();
  EXPECT_EQ(cores_of_quotas(root), kUnlimited) << "no control groups";
  write("proc/self/cgroup", "0::/pods/one\n");
  EXPECT_EQ(cores_of_quotas(root), kUnlimited) << "no quotas";
  write("sys/fs/cgroup/pods/cpu.max", "max 100000\n");
  EXPECT_EQ(cores_of_quotas(root), kUnlimited);
  write("sys/fs/cgroup/pods/one/cpu.max", "250000 100000\n");
  EXPECT_EQ(cores_of_quotas(root), 3u) << "rounded up";
  write("sys/fs/cgroup/pods/cpu.max", "200000 100000\n");
  EXPECT_EQ(cores_of_quotas(root), 2u) << "the group that contains it";
  write("sys/fs/cgroup/cpu.max", "1000 100000\n");
  EXPECT_EQ(cores_of_quotas(root), 1u) << "in a container, the folder itself";
  write("proc/self/cgroup", "4:memory:/x\n3:cpu,cpuacct:/docker/x\n2:cpuset:/\n");
  EXPECT_EQ(cores_of_quotas(root), kUnlimited);
  write("sys/fs/cgroup/cpu/docker/x/cpu.cfs_quota_us", "-1\n");
  write("sys/fs/cgroup/cpu/docker/x/cpu.cfs_period_us", "100000\n");
  EXPECT_EQ(cores_of_quotas(root), kUnlimited);
  write("sys/fs/cgroup/cpu/docker/x/cpu.cfs_quota_us", "150000\n");
  EXPECT_EQ(cores_of_quotas(root), 2u);
  write("proc/self/cgroup", "damaged\n3:cpu\n0::\n::\n");
  EXPECT_EQ(cores_of_quotas(root), 1u);
  EXPECT_GE(usable_cores(), 1u);
  EXPECT_LE(usable_cores(), std::max(1u, std::thread::hardware_concurrency()));
}
#endif

TEST(System, KnowsItsMachine) {
  EXPECT_GT(physical_memory(), std::uint64_t{1} << 26);
  EXPECT_TRUE(std::filesystem::is_regular_file(program_path()));
  EXPECT_THAT(to_text(program_path().stem()), HasSubstr("base_test"));
  EXPECT_NE(run_instead(to_path("no such program"), {}), "");
}

}  // namespace
}  // namespace jfpx
