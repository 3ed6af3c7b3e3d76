/// Environment variables of a test and of the processes that it starts.
#pragma once

#include <jfpx/config.hpp>

#include <cstdlib>
#include <optional>
#include <string>
#include <utility>

namespace jfpx {
inline namespace JFPX_ABI {
namespace test {

/// Sets or removes a variable, and restores it in the destructor.
class EnvironmentVariable {
 public:
  /// @param value empty: removes the variable
  EnvironmentVariable(std::string name, const std::optional<std::string>& value)
      : name_(std::move(name)) {
    if (const char* const before = std::getenv(name_.c_str())) before_ = before;
    set(value);
  }
  ~EnvironmentVariable() { set(before_); }
  EnvironmentVariable(const EnvironmentVariable&) = delete;
  EnvironmentVariable& operator=(const EnvironmentVariable&) = delete;

 private:
  void set(const std::optional<std::string>& value) const {
#if defined(_WIN32)
    _putenv_s(name_.c_str(), value ? value->c_str() : "");  // an empty value removes the variable
#else
    value ? setenv(name_.c_str(), value->c_str(), 1) : unsetenv(name_.c_str());
#endif
  }

  std::string name_;
  std::optional<std::string> before_;
};

#if defined(_WIN32)
inline constexpr const char* kCacheVariable = "LOCALAPPDATA";
#else
inline constexpr const char* kCacheVariable = "XDG_CACHE_HOME";
#endif

}  // namespace test
}  // namespace JFPX_ABI
}  // namespace jfpx
