/// Contract of all sphere colliders. The tests are in sphere_collider_test.cpp; each backend
/// instantiates them for its own options.
#pragma once

#include <jfpx/error.hpp>
#include <jfpx/sphere_collider.hpp>

#include "tests/support/sphere_fixtures.hpp"

#include <cstdlib>
#include <memory>
#include <string>

namespace jfpx {
inline namespace JFPX_ABI {
namespace test {

/// Parameter of the contract.
struct ColliderCase {
  std::string name;  ///< letters, digits and underscores
  SphereColliderOptions options;
};
/// Name that gtest prints on a failure.
inline void PrintTo(const ColliderCase& c, std::ostream* os) { *os << c.name; }
inline std::string case_name(const testing::TestParamInfo<ColliderCase>& info) {
  return info.param.name;
}

/// Instantiate with
///   INSTANTIATE_TEST_SUITE_P(Cuda, SphereColliderContract, testing::Values(...), case_name);
/// in a source of the same program. If the backend is unusable, the tests are skipped with the
/// reason; they fail if the environment variable JFPX_REQUIRE_CUDA is set.
class SphereColliderContract : public testing::TestWithParam<ColliderCase> {
 protected:
  void SetUp() override {
    try {
      collider_ = make_sphere_collider(GetParam().options);
    } catch (const BackendUnavailable& e) {
      if (std::getenv("JFPX_REQUIRE_CUDA") != nullptr) FAIL() << e.what();
      GTEST_SKIP() << e.what();
    }
  }

  SphereCollider& collider() { return *collider_; }

 private:
  std::unique_ptr<SphereCollider> collider_;
};

}  // namespace test
}  // namespace JFPX_ABI
}  // namespace jfpx
