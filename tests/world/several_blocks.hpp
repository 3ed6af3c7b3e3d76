/// Worlds with several blocks in tests, which have few bodies.
#pragma once

#include "src/world/bodies/body_store.hpp"

#include <cstdint>

namespace jfpx {
inline namespace JFPX_ABI {
namespace test {

/// While it exists, worlds with more movable bodies than a limit have several blocks.
class SeveralBlocks {
 public:
  explicit SeveralBlocks(std::uint32_t most_in_one_block)
      : before_(BodyStore::most_in_one_block.exchange(most_in_one_block)) {}
  ~SeveralBlocks() { BodyStore::most_in_one_block = before_; }
  SeveralBlocks(const SeveralBlocks&) = delete;
  SeveralBlocks& operator=(const SeveralBlocks&) = delete;

 private:
  std::uint32_t before_;
};

}  // namespace test
}  // namespace JFPX_ABI
}  // namespace jfpx
