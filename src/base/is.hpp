/// Constraint of functions that take a type and its constant form.
#pragma once

#include <jfpx/build.hpp>

#include <concepts>
#include <type_traits>

namespace jfpx {
inline namespace JFPX_ABI {

/// T is U or const U.
template <class T, class U>
concept Is = std::same_as<std::remove_const_t<T>, U>;

}  // namespace JFPX_ABI
}  // namespace jfpx
