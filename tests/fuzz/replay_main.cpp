/// Main program that runs a fuzz target on files and folders of inputs without libFuzzer, so that
/// the corpus is a regression test with every compiler.
#include "tests/fuzz/fuzz.hpp"

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <vector>

namespace {

namespace fs = std::filesystem;

std::vector<fs::path> inputs_of(const fs::path& path) {
  if (!fs::is_directory(path)) return {path};
  std::vector<fs::path> files;
  for (const auto& entry : fs::directory_iterator(path)) files.push_back(entry.path());
  std::sort(files.begin(), files.end());
  return files;
}

void replay(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  if (!file) jfpx::fuzz::report_finding(path.string() + " can't be read");
  const std::vector<char> bytes{std::istreambuf_iterator<char>(file), {}};
  // Printed first, so that the output names the input of a crash.
  std::printf("%s, %zu bytes\n", path.c_str(), bytes.size());
  std::fflush(stdout);
  LLVMFuzzerTestOneInput(reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size());
}

}  // namespace

int main(int count, char** arguments) {
  std::size_t inputs = 0;
  for (int i = 1; i < count; ++i) {
    if (arguments[i][0] == '-') continue;  // ignores options of libFuzzer
    for (const fs::path& path : inputs_of(arguments[i])) {
      replay(path);
      ++inputs;
    }
  }
  std::printf("%zu inputs, no findings\n", inputs);
  return inputs > 0 ? 0 : 2;
}
