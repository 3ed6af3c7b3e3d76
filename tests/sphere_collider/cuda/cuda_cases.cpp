/// Instantiates the SphereCollider contract for CUDA: one case per algorithm.
#include "tests/support/sphere_collider_contract.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace test {
namespace {

ColliderCase make_case(std::string name, SphereAlgorithm algorithm) {
  return {std::move(name), {.backend = Backend::cuda, .algorithm = algorithm}};
}

INSTANTIATE_TEST_SUITE_P(Cuda, SphereColliderContract,
                         testing::Values(make_case("automatic", SphereAlgorithm::automatic),
                                         make_case("all_pairs", SphereAlgorithm::all_pairs),
                                         make_case("grid", SphereAlgorithm::grid)),
                         case_name);

}  // namespace
}  // namespace test
}  // namespace JFPX_ABI
}  // namespace jfpx
