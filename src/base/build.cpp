/// Library part of the link-time check.
#include <jfpx/build.hpp>

namespace jfpx {
inline namespace JFPX_ABI {
namespace detail {

template <std::size_t layout>
const char LibraryUsesSameCompilerSwitches<layout>::value = 1;
template struct LibraryUsesSameCompilerSwitches<sizeof(LayoutProbe)>;

}  // namespace detail
}  // namespace JFPX_ABI
}  // namespace jfpx
