/// Ranges of reserved addresses, from which pages are committed when they are first written.
#include "tests/bullet/arena.hpp"

#include <LinearMath/btAlignedAllocator.h>

#include <algorithm>
#include <cstdlib>
#include <new>

#if defined(_WIN32)
#include <windows.h>
#else
#include <sys/mman.h>
#endif

namespace jfpx::test {

Arena::Arena() {
#if defined(_WIN32)
  void* const memory = VirtualAlloc(nullptr, kRange * kClasses, MEM_RESERVE, PAGE_READWRITE);
  if (memory == nullptr) throw std::bad_alloc();
#else
  void* memory = mmap(nullptr, kRange * kClasses, PROT_READ | PROT_WRITE,
                      MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0);
  if (memory == MAP_FAILED) throw std::bad_alloc();
#endif
  begin_ = static_cast<char*>(memory);
  arenas_.push_back(this);
}

Arena::~Arena() {
  if (selected_ == this) selected_ = nullptr;
  std::erase(arenas_, this);
#if defined(_WIN32)
  VirtualFree(begin_, 0, MEM_RELEASE);
#else
  munmap(begin_, kRange * kClasses);
#endif
}

void Arena::install() { btAlignedAllocSetCustomAligned(allocate_from_selected, release_from_any); }

void* Arena::allocate(std::size_t size) {
  const std::size_t index = (std::max<std::size_t>(size, 1) - 1) / kStep;
  SizeClass& sizes = classes_[index];
  if (!sizes.free.empty()) {
    void* memory = sizes.free.back();
    sizes.free.pop_back();
    return memory;
  }
  void* memory = begin_ + index * kRange + sizes.used;
  sizes.used += (index + 1) * kStep;
  if (sizes.used > kRange) throw std::bad_alloc();
#if defined(_WIN32)  // does not commit pages by itself
  if (VirtualAlloc(memory, size, MEM_COMMIT, PAGE_READWRITE) == nullptr) throw std::bad_alloc();
#endif
  return memory;
}

void Arena::release(void* memory) {
  const auto offset = static_cast<std::size_t>(static_cast<char*>(memory) - begin_);
  classes_[offset / kRange].free.push_back(memory);
}

void* Arena::allocate_from_selected(std::size_t size, int alignment) {
  if (selected_ != nullptr && size <= kStep * kClasses) return selected_->allocate(size);
  const auto aligned = static_cast<std::size_t>(std::max(alignment, 16));
  return std::aligned_alloc(aligned, (size + aligned - 1) / aligned * aligned);
}

void Arena::release_from_any(void* memory) {
  for (Arena* arena : arenas_) {
    if (memory < arena->begin_ || memory >= arena->begin_ + kRange * kClasses) continue;
    arena->release(memory);
    return;
  }
  std::free(memory);
}

}  // namespace jfpx::test
