/// A tree of bounding boxes in the memory of a device.
#pragma once

#include "src/collide/block_tree.hpp"
#include "src/world/device/transfer.hpp"

#include <cstddef>
#include <cstdint>

namespace jfpx {
inline namespace JFPX_ABI {
namespace device {

template <class Device>
class BlockTreeBuffers {
 public:
  /// Copies a tree to the device. @returns its view there
  BlockTreeView upload(const Transfer<Device>& transfer, BlockTreeView tree) {
    transfer.put(&items_, tree.items, std::size_t{tree.leaf_blocks} * TreeBlock::kWidth);
    transfer.put(&blocks_, tree.blocks, tree.block_count);
    tree.items = items_.data();
    tree.blocks = blocks_.data();
    return tree;
  }

 private:
  typename Device::template Buffer<TreeBlock> blocks_;
  typename Device::template Buffer<std::uint32_t> items_;
};

}  // namespace device
}  // namespace JFPX_ABI
}  // namespace jfpx
