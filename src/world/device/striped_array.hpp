/// Array of structures on a device, with a memory layout for warps.
#pragma once

#include <jfpx/config.hpp>

#include <bit>
#include <cstddef>
#include <cstdint>
#include <type_traits>

namespace jfpx {
inline namespace JFPX_ABI {
namespace device {

/// Stores items in pieces of 16 bytes: the first pieces of all items, then all second pieces, and
/// so on. Consecutive threads that read consecutive items thus access consecutive addresses.
/// @tparam T trivially copyable, a multiple of 16 bytes
template <class T>
class StripedArray {
 public:
  static constexpr std::size_t kPieces = sizeof(T) / 16;
  struct alignas(16) Piece {
    std::uint32_t words[4];
  };
  struct Item {
    Piece pieces[kPieces];
  };

  StripedArray() = default;
  /// @param memory of `capacity` items, aligned to 16 bytes
  StripedArray(T* memory, std::size_t capacity)
      : pieces_(reinterpret_cast<Piece*>(memory)), capacity_(capacity) {}

  /// Piece k of item i.
  JFPX_HD const Piece* piece(std::size_t i, std::size_t k) const {
    return &pieces_[k * capacity_ + i];
  }
  JFPX_HD T load(std::size_t i) const {
    Item item;
    for (std::size_t k = 0; k < kPieces; ++k) item.pieces[k] = *piece(i, k);
    return std::bit_cast<T>(item);
  }
  JFPX_HD void store(std::size_t i, const T& value) const { store_bytes<0, sizeof(T)>(i, value); }

  /// Stores the pieces of an item that have bytes in [kBegin, kEnd).
  template <std::size_t kBegin, std::size_t kEnd>
  JFPX_HD void store_bytes(std::size_t i, const T& value) const {
    const Item item = std::bit_cast<Item>(value);
    constexpr std::size_t kLast = (kEnd + sizeof(Piece) - 1) / sizeof(Piece);
    for (std::size_t k = kBegin / sizeof(Piece); k < kLast; ++k) {
      pieces_[k * capacity_ + i] = item.pieces[k];
    }
  }

 private:
  static_assert(std::is_trivially_copyable_v<T> && sizeof(T) % 16 == 0);

  Piece* pieces_ = nullptr;
  std::size_t capacity_ = 0;
};

}  // namespace device
}  // namespace JFPX_ABI
}  // namespace jfpx
