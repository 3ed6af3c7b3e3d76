/// Notices a program that was compiled with other headers than those of the library that it runs
/// with.
#pragma once

#include <jfpx/config.hpp>

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {

namespace detail {

/// Changes its size with what compilers and switches like _GLIBCXX_DEBUG, _GLIBCXX_USE_CXX11_ABI
/// and -fpack-struct do to the types that callers and library exchange.
struct LayoutProbe {
  std::vector<Real> vector;
  std::string text;
  char character;
  double number;
};

/// From the top: major and minor version, 8 bits each; bytes of a Real, 16; layout, 32.
constexpr std::uint64_t pack_build(std::uint64_t major, std::uint64_t minor, std::size_t real,
                                   std::size_t layout) {
  return major << 56 | minor << 48 | static_cast<std::uint64_t>(real) << 32 | layout;
}

}  // namespace detail

/// What headers and library must agree on. An enumerator, because the value must be that of the
/// translation unit that names it: the linker would merge a variable or function of several.
enum class Build : std::uint64_t {
  of_these_headers = detail::pack_build(JFPX_VERSION_MAJOR, JFPX_VERSION_MINOR, sizeof(Real),
                                        sizeof(detail::LayoutProbe))
};

/// Called by make_sphere_collider(), and so by worlds that make their collider, by
/// DeviceSphereCollider and by what of jfpx::bullet replaces a part of Bullet. A program may call
/// it earlier.
/// @throws BuildMismatch that says how `headers` and the library differ. Thread-safe.
JFPX_API void verify_build(Build headers = Build::of_these_headers);

}  // namespace JFPX_ABI
}  // namespace jfpx
