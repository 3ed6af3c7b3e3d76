/// The library's side of the comparison of builds.
#include <jfpx/build.hpp>
#include <jfpx/error.hpp>

namespace jfpx {
inline namespace JFPX_ABI {
namespace {

/// "jfpx 0.1 in float, layout 72".
std::string describe(Build build) {
  const auto bits = static_cast<std::uint64_t>(build);
  const std::uint64_t real = bits >> 32 & 0xffff;
  return "jfpx " + std::to_string(bits >> 56) + "." + std::to_string(bits >> 48 & 0xff) + " in " +
         (real == sizeof(float) ? "float" : "double") + ", layout " +
         std::to_string(bits & 0xffffffff);
}

}  // namespace

void verify_build(Build headers) {
  if (headers == Build::of_these_headers) return;
  throw BuildMismatch("the program was compiled with the headers of " + describe(headers) +
                      ", but the library is " + describe(Build::of_these_headers) +
                      ": compile it with the library's headers, and with the same switches that "
                      "change the layout of types (_GLIBCXX_DEBUG, -fpack-struct)");
}

}  // namespace JFPX_ABI
}  // namespace jfpx
