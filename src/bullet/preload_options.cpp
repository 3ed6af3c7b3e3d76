/// Reading the environment; see the header.
#include "src/bullet/preload_options.hpp"

#include <charconv>
#include <cstdlib>

namespace jfpx::inline JFPX_ABI::bullet {

std::string_view preload_setting(const char* name) {
  const char* value = std::getenv(name);
  return value == nullptr ? std::string_view{} : value;
}

std::optional<unsigned long long> preload_number(const char* name) {
  const std::string_view text = preload_setting(name);
  unsigned long long value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (text.empty() || error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return value;
}

unsigned preload_threads() {
  const auto threads = preload_number("JFPX_PRELOAD_THREADS");
  return threads && *threads <= 256 ? static_cast<unsigned>(*threads) : 1;
}

}  // namespace jfpx::inline JFPX_ABI::bullet
