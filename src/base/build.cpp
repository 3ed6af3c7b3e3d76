/// The library's side of the link-time check.
#include <jfpx/build.hpp>

namespace jfpx {
inline namespace JFPX_ABI {
namespace detail {

template <>
const char LibraryUsesSameCompilerSwitches<sizeof(LayoutProbe)>::value = 1;

}  // namespace detail
}  // namespace JFPX_ABI
}  // namespace jfpx
