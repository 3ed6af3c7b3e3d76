/// Bullet worlds made of a fuzzer's bytes, with their pair caches full of all that Bullet has: our
/// dispatcher beside Bullet's, all bits compared after each step.
#include "tests/fuzz/bullet_fuzz.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace jfpx;
  test::Bytes bytes({data, size});
  const bullet::RandomWorld world = bullet::make_random_world(bytes);
  const auto failure = run(world, nullptr);
  if (failure && !is_accident_of_stock(world, *failure)) report_difference(*failure, shrink(world));
  return 0;
}
