/// A device that fails inside Bullet: batches continue, the bits do not change, and the statistics
/// report the failure.
#include "tests/bullet/twin_worlds.hpp"
#include "tests/sphere_collider/device_double.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {
namespace {

TEST(DeviceTakeover, KeepsBatchesGoingAndBulletsBits) {
  test::Device device;  // computes the first calls, whatever their measured times
  device.before_call = [&] {
    if (device.calls == 4) throw DeviceError("the device is gone");
  };
  TwinOptions options;
  options.ours = [&](btCollisionConfiguration* configuration) {
    return std::make_unique<CollisionDispatcher>(
        configuration,
        std::make_unique<AutomaticSphereCollider>(test::device_wins(), test::maker_with(&device),
                                                  true),
        DispatcherOptions{.minimum_batch = 0});
  };
  Twins twins(options);
  twins.both([](BulletWorld& w) { add_heap(w, 50, 51); });
  ASSERT_TRUE(twins.step(30));
  EXPECT_EQ(device.calls, 4);
  EXPECT_EQ(twins.stats().batches, 30u);
  EXPECT_EQ(twins.stats().failure, "");
  EXPECT_EQ(twins.stats().device_failure, "the device is gone");
  EXPECT_EQ(twins.ours().ours()->backend(), Backend::cpu);
  twins.ours().ours()->reset_stats();
  EXPECT_EQ(twins.stats().device_failure, "the device is gone");
}

}  // namespace
}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
