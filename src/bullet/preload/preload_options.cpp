/// Parsing of the environment variables.
#include "src/bullet/preload/preload_options.hpp"

#include "src/base/thread_pool.hpp"

#include <charconv>
#include <cstdio>
#include <cstdlib>
#include <limits>
#include <string_view>

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {
namespace {

/// The value of the variable; empty if it is not set.
std::string_view setting(const char* name) {
  const char* value = std::getenv(name);
  return value == nullptr ? std::string_view{} : value;
}

void ignore(const char* name, std::string_view value, const char* allowed) {
  std::fprintf(stderr, "jfpx preload: %s is \"%.*s\"; it must be %s. The value is ignored.\n", name,
               static_cast<int>(value.size()), value.data(), allowed);
}

std::optional<std::size_t> number(const char* name, std::size_t most, const char* allowed) {
  const std::string_view text = setting(name);
  if (text.empty()) return std::nullopt;
  std::size_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error == std::errc() && end == text.data() + text.size() && value <= most) return value;
  ignore(name, text, allowed);
  return std::nullopt;
}

PreloadOptions read() {
  PreloadOptions options;
  constexpr const char* kBackend = "JFPX_PRELOAD_BACKEND";
  if (const std::string_view text = setting(kBackend); !text.empty()) {
    if (const auto backend = parse_backend(text)) {
      options.backend = *backend;
    } else {
      ignore(kBackend, text, "auto, cpu or cuda");
    }
  }
  static_assert(ThreadPool::kMaxThreads == 256, "the message below contains the limit");
  if (const auto threads = number("JFPX_PRELOAD_THREADS", ThreadPool::kMaxThreads, "0 to 256")) {
    options.threads = static_cast<unsigned>(*threads);
  }
  options.minimum_batch = number("JFPX_PRELOAD_MINIMUM_BATCH",
                                 std::numeric_limits<std::size_t>::max(), "a whole number");
  const std::string_view verify = setting("JFPX_PRELOAD_VERIFY");
  options.verify = !verify.empty() && verify != "0";
  return options;
}

}  // namespace

const PreloadOptions& preload_options() {
  static const PreloadOptions options = read();
  return options;
}

}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
