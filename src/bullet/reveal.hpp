/// Access to private members of Bullet's classes.
#pragma once

#include <jfpx/config.hpp>

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {

/// Defines the function member_of(Tag), which a friend declaration in Tag declares, to return the
/// pointer `Member`. The language exempts explicit instantiations from access checks.
template <class Tag, auto Member>
struct Reveal {
  friend auto member_of(Tag) -> decltype(Member) { return Member; }
};

}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
