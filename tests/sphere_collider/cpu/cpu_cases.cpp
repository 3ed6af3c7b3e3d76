/// The contract of SphereCollider on the CPU: every algorithm, every vector width and some thread
/// counts.
#include "tests/support/sphere_collider_contract.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace test {
namespace {

ColliderCase make_case(std::string name, SphereAlgorithm algorithm, SimdLevel simd,
                       unsigned threads) {
  return {std::move(name),
          {.backend = Backend::cpu, .algorithm = algorithm, .threads = threads, .simd = simd}};
}

std::vector<ColliderCase> cases() {
  const std::pair<const char*, SimdLevel> levels[] = {{"scalar", SimdLevel::scalar},
                                                      {"sse2", SimdLevel::sse2},
                                                      {"avx2", SimdLevel::avx2},
                                                      {"avx512", SimdLevel::avx512}};
  const std::pair<const char*, SphereAlgorithm> algorithms[] = {
      {"all_pairs", SphereAlgorithm::all_pairs}, {"grid", SphereAlgorithm::grid}};
  std::vector<ColliderCase> cases;
  for (const auto& [algorithm_name, algorithm] : algorithms) {
    for (const auto& [level_name, level] : levels) {
      cases.push_back(
          make_case(std::string(algorithm_name) + "_" + level_name, algorithm, level, 1));
    }
    for (const unsigned threads : {2u, 3u, 8u}) {
      cases.push_back(make_case(std::string(algorithm_name) + "_threads" + std::to_string(threads),
                                algorithm, SimdLevel::automatic, threads));
    }
  }
  cases.push_back(make_case("automatic", SphereAlgorithm::automatic, SimdLevel::automatic, 1));
  return cases;
}

INSTANTIATE_TEST_SUITE_P(X86, SphereColliderContract, testing::ValuesIn(cases()), case_name);

}  // namespace
}  // namespace test
}  // namespace JFPX_ABI
}  // namespace jfpx
