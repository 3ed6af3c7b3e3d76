/// Output of the commands: tables, progress and files.
#pragma once

#include <jfpx/config.hpp>

#include "src/base/atomic_file.hpp"
#include "src/tool/interrupts.hpp"

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace tool {

/// Destination of results: a file that appears when it is complete, "-" for stdout, "" for none.
class OutputFile {
 public:
  /// Opens the file, so that an invalid path fails before a long run. @throws FileError
  explicit OutputFile(std::string path);

  explicit operator bool() const { return !path_.empty(); }
  /// @throws FileError
  void write(const std::string& text);
  /// @throws FileError
  void finish();

 private:
  std::string path_;
  std::optional<AtomicFile> file_;
};

/// Rows of cells. The first row is the header; the first column is left-aligned, the others are
/// right-aligned.
class Table {
 public:
  explicit Table(std::vector<std::string> head) { rows_.push_back(std::move(head)); }
  void add(std::vector<std::string> row) { rows_.push_back(std::move(row)); }
  std::string text() const;

 private:
  std::vector<std::vector<std::string>> rows_;
};

/// Progress bar on stderr, shown only if stderr is a terminal, and by rank 0. Ctrl-C ends the run.
class Progress {
 public:
  /// @param ranks those that run together, of which each makes the same calls; null: one process
  Progress(std::string label, std::uint64_t total, bool quiet, Communicator* ranks = nullptr);
  ~Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;
  /// @throws Interrupted
  void advance_to(std::uint64_t done);

 private:
  Interrupts interrupts_;
  Communicator* ranks_;
  std::string label_;
  std::uint64_t total_;
  int percent_ = -1;
  bool shown_;
};

/// 16 lower-case hexadecimal digits.
std::string hex(std::uint64_t value);
/// The bits of a Real in lower-case hexadecimal digits.
std::string hex_bits(Real value);
/// The shortest text that parses to the same Real.
std::string text(Real value);
/// Milliseconds with three decimals.
std::string ms(double value);

}  // namespace tool
}  // namespace JFPX_ABI
}  // namespace jfpx
