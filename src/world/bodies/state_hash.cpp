/// Hash of the states of all bodies.
#include <jfpx/body.hpp>

#include "src/base/hash64.hpp"

#include <bit>
#include <type_traits>

namespace jfpx {
inline namespace JFPX_ABI {

// Hashed words: the size of Real, the number of bodies, then 13 words per body, each the
// zero-extended bits of a Real.
std::uint64_t state_hash(std::span<const BodyState> states) noexcept {
  using Bits = std::conditional_t<sizeof(Real) == 4, std::uint32_t, std::uint64_t>;
  Hash64 hash;
  hash.add_word(sizeof(Real));
  hash.add_word(states.size());
  for (const BodyState& s : states) {
    for (const Real value :
         {s.position.x, s.position.y, s.position.z, s.orientation.w, s.orientation.x,
          s.orientation.y, s.orientation.z, s.velocity.x, s.velocity.y, s.velocity.z,
          s.angular_velocity.x, s.angular_velocity.y, s.angular_velocity.z}) {
      hash.add_word(std::bit_cast<Bits>(value));
    }
  }
  return hash.value();
}

}  // namespace JFPX_ABI
}  // namespace jfpx
