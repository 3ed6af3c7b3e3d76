/// Bullet worlds generated from a fuzzer's bytes, with joints and changing settings: our solver,
/// our world or all three parts beside Bullet's, with all bits compared after each step.
#include "tests/fuzz/bullet_fuzz.hpp"

#include <algorithm>

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace jfpx::bullet;
  constexpr MakeParts kParts[] = {our_solver, our_world, our_solver_and_world};
  jfpx::test::Bytes bytes({data, size});
  const std::uint64_t parts = bytes.below(4);
  const MakeDispatcher dispatcher = parts == 3 ? make_ours : make_stock;
  const SolverWorld world = make_solver_world(bytes);
  const MakeParts ours = kParts[std::min<std::uint64_t>(parts, 2)];
  if (const auto failure = run(world, nullptr, ours, dispatcher)) {
    report_difference(*failure, shrink(world, ours, dispatcher));
  }
  return 0;
}
