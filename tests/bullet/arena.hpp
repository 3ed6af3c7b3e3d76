/// Memory of Bullet worlds at comparable addresses. Bullet's tree compares the addresses of its
/// nodes when it optimizes itself, so two worlds have the same tree only if their nodes have the
/// same order in memory.
#pragma once

#include <cstddef>
#include <vector>

namespace jfpx::test {

/// While an arena is selected, Bullet allocates small objects there: those of each size in a range
/// of addresses of its own, most recently freed first. Equal sequences of calls for one size return
/// equal offsets.
class Arena {
 public:
  Arena();
  ~Arena();
  Arena(const Arena&) = delete;
  Arena& operator=(const Arena&) = delete;

  void select() noexcept { selected_ = this; }
  static void select_none() noexcept { selected_ = nullptr; }
  /// Makes Bullet allocate through arenas. Must be called before Bullet's first allocation.
  static void install();

 private:
  static constexpr std::size_t kStep = 16, kClasses = 32, kRange = std::size_t{1} << 26;
  struct SizeClass {
    std::size_t used = 0;
    std::vector<void*> free;
  };

  void* allocate(std::size_t size);
  void release(void* memory);
  static void* allocate_from_selected(std::size_t size, int alignment);
  static void release_from_any(void* memory);

  static inline Arena* selected_ = nullptr;
  static inline std::vector<Arena*> arenas_;
  char* begin_;
  SizeClass classes_[kClasses];
};

}  // namespace jfpx::test
