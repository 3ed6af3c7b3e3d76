/// The memory that two compared worlds allocate through Bullet's allocator.
#pragma once

#include "tests/bullet/twin_worlds.hpp"

#include <LinearMath/btAlignedAllocator.h>

#include <algorithm>
#include <map>
#include <mutex>
#include <new>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {

/// Bullet's allocator while the object exists, which must be longer than that of the worlds. Its
/// destructor frees the blocks that are left.
class BulletMemory {
 public:
  BulletMemory() {
    current_ = this;
    btAlignedAllocSetCustomAligned(allocate, release);
  }
  ~BulletMemory() {
    btAlignedAllocSetCustomAligned(nullptr, nullptr);
    current_ = nullptr;
    for (const auto& [memory, block] : blocks_) ::operator delete(memory, block.alignment);
  }
  BulletMemory(const BulletMemory&) = delete;
  BulletMemory& operator=(const BulletMemory&) = delete;

  /// The sizes [bytes] of the blocks that were allocated while the world was g_current, and that
  /// have not been freed, ascending. The world need not exist any longer.
  std::vector<std::size_t> blocks_of(const BulletWorld* world) const {
    std::vector<std::size_t> sizes;
    for (const auto& [memory, block] : blocks_) {
      if (block.world == world) sizes.push_back(block.size);
    }
    std::sort(sizes.begin(), sizes.end());
    return sizes;
  }

 private:
  struct Block {
    std::size_t size;
    std::align_val_t alignment;
    const BulletWorld* world;
  };

  static void* allocate(std::size_t size, int alignment) {
    const Block block{size, std::align_val_t(std::max(alignment, 16)), g_current};
    void* memory = ::operator new(size, block.alignment);
    const std::lock_guard lock(current_->mutex_);
    current_->blocks_.emplace(memory, block);
    return memory;
  }
  static void release(void* memory) {
    const std::lock_guard lock(current_->mutex_);
    const auto found = current_->blocks_.find(memory);
    if (found == current_->blocks_.end()) {
      ADD_FAILURE() << "a block of another allocator, or freed twice";
      return;
    }
    const std::align_val_t alignment = found->second.alignment;
    current_->blocks_.erase(found);
    ::operator delete(memory, alignment);
  }

  static inline BulletMemory* current_ = nullptr;
  std::mutex mutex_;
  std::map<void*, Block> blocks_;
};

}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
