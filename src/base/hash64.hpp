/// Incremental 64-bit hash of words and bytes, for state hashes and checksums.
#pragma once

#include <jfpx/config.hpp>

#include <cstddef>
#include <cstdint>
#include <cstring>

namespace jfpx {
inline namespace JFPX_ABI {

/// FNV-1a (Fowler, Noll, Vo) over 64-bit words with a xor-shift after each word, and the finalizer
/// of splitmix64. Each step is a bijection of the state, so a change of one word changes the value.
/// Not for cryptography.
class Hash64 {
 public:
  constexpr void add_word(std::uint64_t word) {
    state_ = (state_ ^ word) * 0x00000100000001b3u;
    state_ ^= state_ >> 29;
  }
  /// Adds the bytes as little-endian words. The last word is padded with zeros, and the length
  /// follows as a word.
  void add_bytes(const void* data, std::size_t size) {
    const auto* bytes = static_cast<const unsigned char*>(data);
    for (std::size_t i = 0; i < size; i += sizeof(std::uint64_t)) {
      std::uint64_t word = 0;
      const std::size_t left = size - i;
      std::memcpy(&word, bytes + i, left < sizeof word ? left : sizeof word);
      add_word(word);
    }
    add_word(size);
  }
  /// The hash of all words added so far.
  constexpr std::uint64_t value() const {
    std::uint64_t z = state_;
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
    return z ^ (z >> 31);
  }

 private:
  std::uint64_t state_ = 0xcbf29ce484222325u;
};

}  // namespace JFPX_ABI
}  // namespace jfpx
