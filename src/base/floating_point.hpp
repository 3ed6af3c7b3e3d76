/// Floating-point environment of the calling thread.
#pragma once

#include <jfpx/config.hpp>

#include <cfenv>
#include <cstdint>

#if defined(__x86_64__)
#include <xmmintrin.h>
#endif

namespace jfpx {
inline namespace JFPX_ABI {

/// Masks the traps of floating-point exceptions during its lifetime, and then restores the traps
/// and status flags. Idle vector lanes and comparisons with NaN raise exceptions that have no
/// effect on results.
class TrapsMasked {
 public:
#if defined(__x86_64__)
  // Only the x87 unit has another register, and no code of jfpx uses it.
  TrapsMasked() noexcept : kept_(_mm_getcsr()) { _mm_setcsr(kept_ | _MM_MASK_MASK); }
  ~TrapsMasked() { _mm_setcsr(kept_); }
#else
  TrapsMasked() noexcept { std::feholdexcept(&kept_); }
  ~TrapsMasked() { std::fesetenv(&kept_); }
#endif
  TrapsMasked(const TrapsMasked&) = delete;
  TrapsMasked& operator=(const TrapsMasked&) = delete;

 private:
#if defined(__x86_64__)
  unsigned kept_;
#else
  std::fenv_t kept_{};
#endif
};

/// The rounding, traps and flush-to-zero of a thread, and the status flags of its vector unit.
class FloatingPointEnvironment {
 public:
#if defined(__x86_64__)
  // std::fegetenv() takes as long as a short loop of the thread pool: it stores and loads the whole
  // environment of the x87 unit.
  /// That of the calling thread.
  FloatingPointEnvironment() noexcept { asm volatile("fnstcw %0" : "=m"(x87_)); }
  /// Makes it that of the calling thread.
  void apply() const noexcept {
    asm volatile("fldcw %0" : : "m"(x87_));
    _mm_setcsr(vector_);
  }

 private:
  std::uint16_t x87_ = 0;
  unsigned vector_ = _mm_getcsr();
#else
  /// That of the calling thread.
  FloatingPointEnvironment() noexcept { std::fegetenv(&environment_); }
  /// Makes it that of the calling thread.
  void apply() const noexcept { std::fesetenv(&environment_); }

 private:
  std::fenv_t environment_{};
#endif
};

/// Whether no floating-point exception raises a trap.
inline bool traps_are_masked() noexcept {
#if defined(__x86_64__)
  return (_mm_getcsr() & _MM_MASK_MASK) == _MM_MASK_MASK;
#else
  constexpr std::uint64_t kTraps = 0x9f00;  // IDE, IXE, UFE, OFE, DZE, IOE (Arm ARM, FPCR)
  std::uint64_t fpcr;
  asm volatile("mrs %0, fpcr" : "=r"(fpcr));
  return (fpcr & kTraps) == 0;
#endif
}

/// Whether results are rounded to the nearest value, the default.
inline bool rounds_to_nearest() noexcept {
#if defined(__x86_64__)
  return (_mm_getcsr() & _MM_ROUND_MASK) == _MM_ROUND_NEAREST;
#else
  return std::fegetround() == FE_TONEAREST;
#endif
}

}  // namespace JFPX_ABI
}  // namespace jfpx
