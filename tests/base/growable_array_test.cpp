/// Growth policy of the device and pinned buffers, over a counting allocator: no GPU is needed.
#include "src/base/cuda/growable_array.hpp"

#include <gtest/gtest.h>

#include <cstdint>
#include <memory>
#include <new>

namespace jfpx {
inline namespace JFPX_ABI {
namespace cuda {
namespace {

/// Host memory that stands for device memory.
class HostMemory {
 public:
  HostMemory() = default;
  explicit HostMemory(std::size_t bytes) : bytes_(new unsigned char[bytes]) {}
  void* data() const noexcept { return bytes_.get(); }

 private:
  std::unique_ptr<unsigned char[]> bytes_;
};

/// Counts its allocations, and throws while `fails` is set.
struct CountingAllocator {
  HostMemory operator()(std::size_t bytes) {
    if (fails) throw std::bad_alloc();
    ++allocations;
    last_bytes = bytes;
    return HostMemory(bytes);
  }
  int allocations = 0;
  std::size_t last_bytes = 0;
  bool fails = false;
};

class GrowableArrayTest : public testing::Test {
 protected:
  bool reserve(std::size_t count) {
    return array_.reserve(count, [this](std::size_t bytes) { return allocator_(bytes); });
  }
  bool reserve_geometric(std::size_t count) {
    return array_.reserve_geometric(count, [this](std::size_t bytes) { return allocator_(bytes); });
  }
  GrowableArray<std::uint32_t, HostMemory> array_;
  CountingAllocator allocator_;
};

// A buffer with a quarter of slack must use that slack before it reallocates: 1000, 1001, ... are
// not a reallocation each.
TEST_F(GrowableArrayTest, UsesItsSlackBeforeItReallocates) {
  EXPECT_TRUE(reserve_geometric(1000));
  const std::size_t capacity = array_.capacity();
  EXPECT_GE(capacity, 1250u);
  EXPECT_EQ(allocator_.last_bytes, capacity * sizeof(std::uint32_t));
  for (std::size_t count = 1001; count <= capacity; ++count) {
    EXPECT_FALSE(reserve_geometric(count)) << count;
  }
  EXPECT_EQ(allocator_.allocations, 1);
  EXPECT_TRUE(reserve_geometric(capacity + 1));
  EXPECT_EQ(allocator_.allocations, 2);
}

TEST_F(GrowableArrayTest, AMillionStepsOfOneElementReallocateFewTimes) {
  for (std::size_t count = 1; count <= 1'000'000; ++count) {
    reserve_geometric(count);
    ASSERT_GE(array_.capacity(), count);
  }
  EXPECT_LE(allocator_.allocations, 50);
  EXPECT_LE(array_.capacity(), 1'250'100u);
}

TEST_F(GrowableArrayTest, ReservesExactlyWithoutSlack) {
  EXPECT_TRUE(reserve(1000));
  EXPECT_EQ(array_.capacity(), 1000u);
  EXPECT_FALSE(reserve(1000));
  EXPECT_FALSE(reserve(3));
  EXPECT_FALSE(reserve_geometric(1000));
  EXPECT_EQ(array_.capacity(), 1000u);
}

TEST_F(GrowableArrayTest, IsUnchangedWhenAnAllocationFails) {
  reserve(10);
  array_.data()[9] = 7;
  allocator_.fails = true;
  EXPECT_THROW(reserve_geometric(11), std::bad_alloc);
  EXPECT_EQ(array_.capacity(), 10u);
  EXPECT_EQ(array_.data()[9], 7u);
  allocator_.fails = false;
  EXPECT_TRUE(reserve_geometric(11));
}

TEST(GeometricCapacity, IsNeverLessThanTheCount) {
  constexpr std::size_t kMax = std::numeric_limits<std::size_t>::max();
  for (const std::size_t count : {std::size_t{0}, std::size_t{1}, kMax / 2, kMax - 1, kMax}) {
    EXPECT_GE(geometric_capacity(0, count), count);
  }
}

TEST(GeometricCapacity, SlackDoesNotExceedTheLimit) {
  constexpr std::size_t kLimit = std::size_t{1} << 31;
  EXPECT_EQ(geometric_capacity(0, kLimit - 1000, kLimit), kLimit);
  EXPECT_EQ(geometric_capacity(0, kLimit, kLimit), kLimit);
  EXPECT_EQ(geometric_capacity(0, kLimit + 1, kLimit), kLimit + 1);  // reported by its own number
  EXPECT_EQ(geometric_capacity(kLimit, kLimit - 1, kLimit), kLimit);
}

}  // namespace
}  // namespace cuda
}  // namespace JFPX_ABI
}  // namespace jfpx
