/// What every sphere collider must do, whatever its backend: the tests are in
/// sphere_collider_test.cpp, each backend instantiates them for its own options.
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

struct ColliderCase {
  std::string name;  ///< letters, digits and underscores
  SphereColliderOptions options;
};
/// Named by gtest on a failure.
inline void PrintTo(const ColliderCase& c, std::ostream* os) { *os << c.name; }
inline std::string case_name(const testing::TestParamInfo<ColliderCase>& info) {
  return info.param.name;
}

/// Instantiate with
///   INSTANTIATE_TEST_SUITE_P(Cuda, SphereColliderContract, testing::Values(...), case_name);
/// in a source of the same program. Where the backend is not usable the tests are skipped, with
/// its reason; they fail if the environment has JFPX_REQUIRE_CUDA=1.
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
