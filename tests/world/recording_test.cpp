/// Tests of recordings: round trip, damaged files, and the difference of two frames.
#include <jfpx/error.hpp>
#include <jfpx/random.hpp>
#include <jfpx/recording.hpp>

#include "src/base/hash64.hpp"
#include "src/scenes/scenes.hpp"
#include "tests/support/temporary_folder.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstring>
#include <filesystem>
#include <fstream>
#include <sstream>

#if !defined(_WIN32)
#include "tests/support/full_disk.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>
#endif

namespace jfpx {
namespace {

using ::testing::HasSubstr;

std::vector<BodyState> random_states(std::size_t bodies, std::uint64_t seed) {
  Random random(seed);
  std::vector<BodyState> states(bodies);
  for (BodyState& state : states) {
    state.position = random.uniform_in_box({-9, -9, -9}, {9, 9, 9});
    state.velocity = random.uniform_in_box({-9, -9, -9}, {9, 9, 9});
  }
  return states;
}

RecordingHeader header_of(std::uint32_t spheres) {
  return {
      .engine = "native", .backend = "cpu", .scene = scenes::make("overlap", {.spheres = spheres})};
}

void write_recording(const std::string& path, std::uint32_t spheres, std::uint64_t steps) {
  RecordingWriter writer(path, header_of(spheres));
  for (std::uint64_t step = 1; step <= steps; ++step) writer.append(random_states(spheres, step));
  writer.finish();
}

std::string content_of(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  std::stringstream content;
  content << file.rdbuf();
  return content.str();
}

void overwrite(const std::string& path, const std::string& content) {
  std::ofstream(path, std::ios::binary | std::ios::trunc) << content;
}

TEST(Recording, ReadsBackWhatWasWritten) {
  const test::TemporaryFolder folder;
  const std::string path = folder.file("run.rec");
  for (const std::uint32_t spheres : {0u, 1u, 17u}) {
    for (const std::uint64_t steps : {0u, 1u, 5u}) {
      write_recording(path, spheres, steps);
      RecordingReader reader(path);
      EXPECT_EQ(reader.header(), header_of(spheres));
      ASSERT_EQ(reader.steps(), steps);
      for (std::uint64_t step = steps; step >= 1; --step) {
        EXPECT_EQ(reader.states(step), random_states(spheres, step));
      }
      EXPECT_THROW(reader.states(0), InvalidArgument);
      EXPECT_THROW(reader.states(steps + 1), InvalidArgument);
    }
  }
  EXPECT_EQ(recording_precision(path), sizeof(Real) == 4 ? "float" : "double");
}

TEST(Recording, OfNoBodiesMayHaveMoreFramesThanBytes) {
  const test::TemporaryFolder folder;
  const std::string path = folder.file("empty.rec");
  write_recording(path, 0, 5000);
  EXPECT_EQ(RecordingReader(path).steps(), 5000u);
}

TEST(Recording, IsFinishedOnce) {
  const test::TemporaryFolder folder;
  const std::string path = folder.file("run.rec");
  RecordingWriter writer(path, header_of(17));
  writer.append(random_states(17, 1));
  writer.finish();
  EXPECT_THROW(writer.finish(), FileError);
  EXPECT_THROW(writer.append(random_states(17, 2)), FileError);
  EXPECT_EQ(RecordingReader(path).steps(), 1u);
}

#if !defined(_WIN32)
TEST(Recording, IsNotFinishedAfterAFailedWrite) {
  const test::TemporaryFolder folder;
  const std::string full = folder.file("full.rec");
  RecordingWriter unlucky(full, header_of(1000));
  {
    const test::FullDisk disk;
    EXPECT_THROW(for (int i = 0; i < 100; ++i) unlucky.append(random_states(1000, 1)), FileError);
  }
  EXPECT_THROW(unlucky.finish(), FileError) << "there is room again, but a frame is cut off";
  EXPECT_FALSE(std::ifstream(full));
}
#endif

TEST(Recording, UnfinishedFileDoesNotAppear) {
  const test::TemporaryFolder folder;
  {
    RecordingWriter writer(folder.file("run.rec"), header_of(3));
    writer.append(random_states(3, 1));
    EXPECT_THROW(writer.append(random_states(4, 1)), InvalidArgument);
  }
  EXPECT_EQ(folder.entries(), 0u);
}

TEST(Recording, EveryFlippedByteIsFound) {
  const test::TemporaryFolder folder;
  const std::string path = folder.file("run.rec");
  write_recording(path, 2, 3);
  const std::string good = content_of(path);
  for (std::size_t i = 0; i < good.size(); ++i) {
    std::string bad = good;
    bad[i] = static_cast<char>(bad[i] ^ 0x10);
    overwrite(path, bad);
    EXPECT_THROW(RecordingReader{path}, FileError) << "byte " << i;
  }
}

TEST(Recording, EveryTruncationIsFound) {
  const test::TemporaryFolder folder;
  const std::string path = folder.file("run.rec");
  write_recording(path, 2, 3);
  const std::string good = content_of(path);
  for (std::size_t size = 0; size < good.size(); ++size) {
    overwrite(path, good.substr(0, size));
    EXPECT_THROW(RecordingReader{path}, FileError) << "size " << size;
  }
}

TEST(Recording, ErrorsNameTheCause) {
  const test::TemporaryFolder folder;
  const std::string path = folder.file("run.rec");
  const auto complaint = [&path] {
    try {
      RecordingReader reader(path);
    } catch (const FileError& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  EXPECT_THAT(complaint(), HasSubstr("run.rec: can't be opened: No such file"));
  overwrite(path, "something else altogether, and long enough to hold a header");
  EXPECT_THAT(complaint(), HasSubstr("is not a jfpx recording"));
  write_recording(path, 2, 3);
  const std::string good = content_of(path);
  overwrite(path, good.substr(0, good.size() - 1));
  EXPECT_THAT(complaint(), HasSubstr("is truncated"));
  std::string bad = good;
  bad[8] = 9;
  overwrite(path, bad);
  EXPECT_THAT(complaint(), HasSubstr("version 9"));
  bad = good;
  bad[12] = sizeof(Real) == 4 ? 8 : 4;
  overwrite(path, bad);
  EXPECT_THAT(complaint(), HasSubstr("this build computes in"));
  bad = good;
  bad[good.size() - 40] ^= 1;
  overwrite(path, bad);
  EXPECT_THAT(complaint(), HasSubstr("checksum"));
}

TEST(Recording, OfABadSceneIsCorruptThoughItsChecksumIsRight) {
  const test::TemporaryFolder folder;
  const std::string path = folder.file("run.rec");
  write_recording(path, 2, 0);
  constexpr std::size_t kPrefix = 24, kTrailer = 24, kChecksum = 16;
  std::string bad = content_of(path);
  bad.replace(bad.find("\"mass\""), 6, "\"moss\"");
  Hash64 hash;
  hash.add_bytes(bad.data(), kPrefix);
  hash.add_bytes(bad.data() + kPrefix, bad.size() - kPrefix - kTrailer);
  hash.add_word(0);
  const std::uint64_t checksum = hash.value();
  std::memcpy(bad.data() + bad.size() - kChecksum, &checksum, sizeof checksum);
  overwrite(path, bad);
  try {
    RecordingReader reader(path);
    ADD_FAILURE() << "an invalid header was accepted";
  } catch (const FileError& error) {
    EXPECT_THAT(error.what(), HasSubstr("run.rec: is corrupt: body 0: has an unknown field"));
  }
}

TEST(Recording, OfNumbersThatAreNeitherFloatNorDoubleHasNoPrecision) {
  const test::TemporaryFolder folder;
  const std::string path = folder.file("run.rec");
  write_recording(path, 1, 1);
  std::string bad = content_of(path);
  bad[12] = 77;
  overwrite(path, bad);
  EXPECT_THROW(recording_precision(path), FileError);
  EXPECT_THROW(RecordingReader{path}, FileError);
}

TEST(Recording, WithANameThatIsNotUtf8IsReadBackWithAReplacement) {
  const test::TemporaryFolder folder;
  const std::string path = folder.file("run.rec");
  RecordingHeader header = header_of(1);
  header.scene.name = "caf\xe9";
  RecordingWriter(path, header).finish();
  EXPECT_EQ(RecordingReader(path).header().scene.name, "caf\xef\xbf\xbd");
}

#if !defined(_WIN32)  // has no pipes in folders, and links for privileged users only
TEST(Recording, IsWrittenThroughASymbolicLink) {
  const test::TemporaryFolder folder;
  const std::string path = folder.file("run.rec"), link = folder.file("link.rec");
  std::filesystem::create_symlink("run.rec", link);
  for (const std::uint64_t steps : {1u, 2u}) {  // first without a file, then with one
    write_recording(link, 3, steps);
    EXPECT_TRUE(std::filesystem::is_symlink(link));
    EXPECT_FALSE(std::filesystem::is_symlink(path));
    EXPECT_EQ(RecordingReader(path).steps(), steps);
    EXPECT_EQ(folder.entries(), 2u);
  }
}

TEST(Recording, IsWrittenIntoAPipeWithoutReplacingIt) {
  const test::TemporaryFolder folder;
  const std::string pipe = folder.file("pipe"), path = folder.file("run.rec");
  ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
  const int reader = open(pipe.c_str(), O_RDONLY | O_NONBLOCK);
  ASSERT_GE(reader, 0);
  write_recording(pipe, 2, 3);  // fits into the pipe
  EXPECT_TRUE(std::filesystem::is_fifo(pipe));
  std::string content(1 << 16, '\0');
  const ssize_t size = read(reader, content.data(), content.size());
  ASSERT_GT(size, 0);
  write_recording(path, 2, 3);
  EXPECT_EQ(content.substr(0, static_cast<std::size_t>(size)), content_of(path));
  { RecordingWriter unfinished(pipe, header_of(2)); }
  EXPECT_TRUE(std::filesystem::is_fifo(pipe));
  close(reader);
}
#endif

TEST(Recording, UnwritablePathIsNamed) {
  const test::TemporaryFolder folder;
  EXPECT_THROW(RecordingWriter(folder.file("no/such/run.rec"), header_of(1)), FileError);
}

TEST(FirstDifference, NamesBodyAndFieldByBits) {
  const std::vector<BodyState> a = random_states(4, 1);
  std::vector<BodyState> b = a;
  EXPECT_FALSE(first_difference(a, b).has_value());
  b[2].angular_velocity.y = Real(-0.0);
  const auto difference = first_difference(a, b);
  ASSERT_TRUE(difference.has_value());
  EXPECT_EQ(difference->body, 2u);
  EXPECT_EQ(difference->field, "angular_velocity.y");
  EXPECT_EQ(difference->expected, 0);
  b.pop_back();
  b[2] = a[2];
  ASSERT_TRUE(first_difference(a, b).has_value());
  EXPECT_EQ(first_difference(a, b)->field, "existence");
  EXPECT_EQ(first_difference(a, b)->body, 3u);
}

}  // namespace
}  // namespace jfpx
