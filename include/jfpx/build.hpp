/// Link-time check that a program and the library use the same layout of standard types.
#pragma once

#include <jfpx/config.hpp>

#include <cstddef>
#include <string>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace detail {

/// A type whose size depends on the compiler switches that change types in the interface:
/// _GLIBCXX_DEBUG, _GLIBCXX_USE_CXX11_ABI, -fpack-struct.
struct LayoutProbe {
  std::vector<Real> vector;
  std::string text;
  char character;
  double number;
};

/// The library defines `value` for its own layout only.
template <std::size_t layout>
struct LibraryUsesSameCompilerSwitches {
  JFPX_API static const char value;
};

/// A translation unit that is compiled with other switches refers to an undefined symbol, so that
/// linking fails.
[[gnu::used]] static const char* const kLayoutCheck =
    &LibraryUsesSameCompilerSwitches<sizeof(LayoutProbe)>::value;

}  // namespace detail
}  // namespace JFPX_ABI
}  // namespace jfpx
