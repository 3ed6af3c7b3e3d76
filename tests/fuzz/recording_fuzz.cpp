/// Fuzzer of recordings: any file can be read and written again, or causes a FileError.
#include <jfpx/error.hpp>
#include <jfpx/recorded_world.hpp>
#include <jfpx/recording.hpp>

#include "src/base/hash64.hpp"
#include "tests/fuzz/fuzz.hpp"
#include "tests/support/temporary_folder.hpp"

#include <algorithm>
#include <cstring>
#include <fstream>
#include <span>
#include <string_view>

namespace jfpx {
inline namespace JFPX_ABI {
namespace {

using fuzz::require;
using Input = std::span<const std::uint8_t>;

/// Bytes of a file, and the checksum that the reader computes.
class File {
 public:
  void add(const void* data, std::size_t size) {
    bytes_.append(static_cast<const char*>(data), size);
    hash_.add_bytes(data, size);
  }
  std::string sealed(std::uint64_t frames) {
    hash_.add_word(frames);
    const std::uint64_t numbers[] = {frames, hash_.value()};
    bytes_.append(reinterpret_cast<const char*>(numbers), sizeof numbers);
    return bytes_ + "JFPXEND\n";
  }

 private:
  std::string bytes_;
  Hash64 hash_;
};

std::uint8_t take_byte(Input* input) {
  if (input->empty()) return 0;
  const std::uint8_t byte = input->front();
  *input = input->subspan(1);
  return byte;
}

/// A file that is valid except for its text and frames. The input consists of the length of the
/// text (2 bytes), the number of frames (1 byte), the text and the frames.
std::string file_around(Input input, std::size_t frame_size) {
  const std::size_t low = take_byte(&input);
  const std::size_t wanted = low | static_cast<std::size_t>(take_byte(&input)) << 8;
  const std::uint64_t frames = take_byte(&input) % 16;
  const Input text = input.first(std::min(wanted, input.size()));
  input = input.subspan(text.size());
  if (frame_size == 0 && frames > 0) frame_size = input.size() / frames;

  File file;
  char prefix[24] = {'J', 'F', 'P', 'X', 'R', 'E', 'C', '\n', 1, 0, 0, 0, sizeof(Real)};
  const std::uint64_t text_size = text.size();
  std::memcpy(prefix + 16, &text_size, sizeof text_size);
  file.add(prefix, sizeof prefix);
  file.add(text.data(), text.size());
  for (std::uint64_t k = 0; k < frames; ++k) {
    const Input given = input.first(std::min(frame_size, input.size()));
    input = input.subspan(given.size());
    std::string frame(given.begin(), given.end());
    frame.resize(frame_size);
    file.add(frame.data(), frame.size());
  }
  return file.sealed(frames);
}

/// A file with one frame of calls, which are the input.
std::string file_with_calls(Input input) {
  Scene scene;
  scene.bodies.resize(3);
  const std::string text =
      R"({"engine": "native", "backend": "cpu", "scene": )" + to_json(scene) + "}";
  const std::uint64_t text_size = text.size();
  char prefix[24] = {'J', 'F', 'P', 'X', 'R', 'E', 'C', '\n', 2, 0, 0, 0, sizeof(Real)};
  std::memcpy(prefix + 16, &text_size, sizeof text_size);
  const std::uint64_t head[] = {input.size(), 0};
  File file;
  file.add(prefix, sizeof prefix);
  file.add(text.data(), text.size());
  file.add(head, sizeof head);
  file.add(input.data(), input.size());
  file.add(nullptr, 0);
  return file.sealed(1);
}

/// The first byte selects whether the rest is the whole file, is embedded in a valid one, or
/// is the calls of one.
std::string file_of(Input input) {
  const std::uint8_t mode = take_byte(&input);
  if (mode % 4 == 0) return {input.begin(), input.end()};
  if (mode % 4 == 1) return file_around(input, 0);
  if (mode == 255) return file_with_calls(input);
  return file_around(input, (mode / 4 % 8) * sizeof(BodyState));
}

/// Repeats calls, which may be any text.
void repeat(RecordingReader& reader) {
  constexpr std::size_t kFew = 16;
  if (reader.header().scene.bodies.size() > kFew) return;
  World world(reader.header().scene, {.collider = {.backend = Backend::cpu}});
  for (std::uint64_t k = 1; k <= std::min<std::uint64_t>(reader.steps(), kFew); ++k) {
    repeat_calls(reader, k, world);
  }
}

void expect_the_same_again(RecordingReader& reader, const std::string& path) {
  RecordingWriter writer(path, reader.header());
  for (std::uint64_t k = 1; k <= reader.steps(); ++k) writer.append(reader.states(k));
  writer.finish();
  RecordingReader again(path);
  require(again.header() == reader.header(), "a header survives");
  require(again.steps() == reader.steps(), "all frames survive");
  for (std::uint64_t k = 1; k <= reader.steps(); ++k) {
    require(!first_difference(reader.states(k), again.states(k)), "frames survive");
  }
}

void read(const std::string& path, const std::string& copy) {
  try {
    RecordingReader reader(path);
    require(recording_precision(path) == (sizeof(Real) == 4 ? "float" : "double"), "precision");
    if (reader.has_calls()) {
      repeat(reader);
    } else if (reader.steps() <= 16) {
      expect_the_same_again(reader, copy);
    }
  } catch (const FileError&) {
  } catch (const InvalidScene&) {  // a half-space that moves, which only a world refuses
  }
}

void read_precision(const std::string& path, std::string_view bytes) {
  try {
    const std::string precision = recording_precision(path);
    std::uint32_t size = 0;
    std::memcpy(&size, bytes.data() + 12, sizeof size);
    require(size == (precision == "float" ? 4u : 8u), "the precision is that of the file");
  } catch (const FileError&) {
  }
}

}  // namespace
}  // namespace JFPX_ABI
}  // namespace jfpx

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace jfpx;
  static const test::TemporaryFolder folder;
  const std::string path = folder.file("in.rec"), bytes = file_of({data, size});
  std::ofstream(path, std::ios::binary | std::ios::trunc) << bytes;
  read_precision(path, bytes);
  read(path, folder.file("out.rec"));
  return 0;
}
