/// The contract of SphereCollider with Backend::automatic.
#include "tests/support/sphere_collider_contract.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace test {
namespace {

/// Like `automatic`, but with predicted costs of zero for the device.
ColliderCase device_first() {
  ColliderCase c{"device_first", {}};
  c.options.costs.cuda_all_pairs = c.options.costs.cuda_grid = {};
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
