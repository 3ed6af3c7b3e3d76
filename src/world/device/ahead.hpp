/// Items that the threads of a device load ahead.
#pragma once

#include "src/world/device/shared_memory.hpp"
#include "src/world/device/striped_array.hpp"
#include "src/world/device/tuning.hpp"

#include <bit>
#include <cstddef>
#include <cstdint>

namespace jfpx {
inline namespace JFPX_ABI {
namespace device {

/// The item that a thread uses next. From compute capability 8.0 on, its copy to shared memory is
/// asynchronous and needs no registers. A program has at most one object of this type at a time.
/// Other threads do not change the item between load() and get().
/// @tparam T       see StripedArray
/// @tparam kOffset of kBytes in the dynamic shared memory of a block, a multiple of 16
template <class T, std::size_t kOffset>
class Ahead {
 public:
  static constexpr std::size_t kBytes = sizeof(T) * tuning::kThreads;

  /// Starts to load item i.
  JFPX_HD void load(const StripedArray<T>& items, std::size_t i) {
#if defined(__CUDA_ARCH__) && __CUDA_ARCH__ >= 800
    for (unsigned k = 0; k < kPieces; ++k) {
      const auto to = static_cast<std::uint32_t>(__cvta_generic_to_shared(piece(k)));
      asm volatile("cp.async.cg.shared.global [%0], [%1], 16;" ::"r"(to), "l"(items.piece(i, k))
                   : "memory");
    }
#else
    item_ = items.load(i);
#endif
  }
  /// Waits for the item.
  JFPX_HD T get() const {
#if defined(__CUDA_ARCH__) && __CUDA_ARCH__ >= 800
    asm volatile("cp.async.wait_all;" ::: "memory");
    typename StripedArray<T>::Item item;
    for (unsigned k = 0; k < kPieces; ++k) item.pieces[k] = *piece(k);
    return std::bit_cast<T>(item);
#else
    return item_;
#endif
  }

 private:
#if defined(__CUDA_ARCH__) && __CUDA_ARCH__ >= 800
  using Piece = typename StripedArray<T>::Piece;
  static constexpr unsigned kPieces = StripedArray<T>::kPieces;

  /// Piece k of the item of this thread. The pieces of a warp are consecutive.
  __device__ static Piece* piece(unsigned k) {
    auto* const pieces = static_cast<Piece*>(dynamic_shared_memory());
    return &pieces[kOffset / sizeof(Piece) + k * tuning::kThreads + threadIdx.x];
  }
#else
  T item_;
#endif
};

}  // namespace device
}  // namespace JFPX_ABI
}  // namespace jfpx
