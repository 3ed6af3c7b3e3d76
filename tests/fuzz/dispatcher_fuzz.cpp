/// Bullet worlds generated from a fuzzer's bytes, with all kinds of pairs: our dispatcher beside
/// Bullet's, with all bits compared after each step.
#include "tests/fuzz/bullet_fuzz.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace jfpx;
  test::Bytes bytes({data, size});
  const bullet::RandomWorld world = bullet::make_random_world(bytes);
  if (const auto failure = run(world, nullptr)) report_difference(*failure, shrink(world));
  return 0;
}
