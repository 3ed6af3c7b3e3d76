/// Output of the commands: tables, progress and files.
#include "src/tool/output.hpp"

#include <jfpx/error.hpp>

#include "src/base/file.hpp"
#include "src/base/system.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cerrno>
#include <cstdio>
#include <type_traits>

namespace jfpx {
inline namespace JFPX_ABI {
namespace tool {

OutputFile::OutputFile(std::string path) : path_(std::move(path)) {
  if (*this && path_ != "-") file_.emplace(path_);
}

void OutputFile::write(const std::string& content) {
  if (file_) {
    file_->write(content);
  } else if (path_ == "-" && std::fputs(content.c_str(), stdout) == EOF) {
    throw FileError(file_message("stdout", "can't be written", errno));
  }
}

void OutputFile::finish() {
  if (file_) file_->finish();
}

std::string Table::text() const {
  std::vector<std::size_t> widths(rows_.front().size());
  for (const auto& row : rows_) {
    for (std::size_t i = 0; i < row.size(); ++i) widths[i] = std::max(widths[i], row[i].size());
  }
  std::string result;
  for (std::size_t r = 0; r < rows_.size(); ++r) {
    std::string line;
    for (std::size_t i = 0; i < rows_[r].size(); ++i) {
      line += i == 0 ? fmt::format("{:<{}}", rows_[r][i], widths[i])
                     : fmt::format("  {:>{}}", rows_[r][i], widths[i]);
    }
    result += line.substr(0, line.find_last_not_of(' ') + 1) + "\n";
    if (r == 0) result += std::string(line.size(), '-') + "\n";
  }
  return result;
}

Progress::Progress(std::string label, std::uint64_t total, bool quiet, Communicator* ranks)
    : ranks_(ranks),
      label_(std::move(label)),
      total_(total),
      shown_(!quiet && is_terminal(stderr) && (ranks == nullptr || ranks->rank() == 0)) {}

Progress::~Progress() {
  if (shown_ && percent_ >= 0) fmt::print(stderr, "\r{:79}\r", "");
}

void Progress::advance_to(std::uint64_t done) {
  Interrupts::check(ranks_);
  if (!shown_ || total_ == 0) return;
  const int percent = static_cast<int>(done * 100 / total_);
  if (percent == percent_) return;
  percent_ = percent;
  const auto filled = static_cast<std::size_t>(percent) * 40 / 100;
  fmt::print(stderr, "\r{} [{}{}] {:3}% {}/{}", label_, std::string(filled, '#'),
             std::string(40 - filled, '.'), percent, done, total_);
}

std::string hex(std::uint64_t value) { return fmt::format("{:016x}", value); }
std::string hex_bits(Real value) {
  using Bits = std::conditional_t<sizeof(Real) == 4, std::uint32_t, std::uint64_t>;
  return fmt::format("0x{:0{}x}", std::bit_cast<Bits>(value), 2 * sizeof(Real));
}
std::string text(Real value) { return fmt::format("{}", value); }
std::string ms(double value) { return fmt::format("{:.3f}", value); }

}  // namespace tool
}  // namespace JFPX_ABI
}  // namespace jfpx
