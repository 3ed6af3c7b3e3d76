/// The contract of SphereCollider where backend and algorithm are chosen call by call.
#include "tests/support/sphere_collider_contract.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace test {
namespace {

/// As `automatic`, but the device, if there is one, is expected to cost nothing.
ColliderCase device_first() {
  ColliderCase c{"device_first", {}};
  c.options.costs.cuda_all_pairs = c.options.costs.cuda_sorted_tiles = {};
  c.options.costs.cuda_given_pairs = {};
  c.options.costs.cuda_start_ms = 0;
  return c;
}

INSTANTIATE_TEST_SUITE_P(Automatic, SphereColliderContract,
                         testing::Values(ColliderCase{"automatic", {}},
                                         ColliderCase{"threads3", {.threads = 3}}, device_first()),
                         case_name);

}  // namespace
}  // namespace test
}  // namespace JFPX_ABI
}  // namespace jfpx
