/// The backend table: its rows are correct, and requesting an unavailable backend is an error.
#include <jfpx/error.hpp>
#include <jfpx/sphere_collider.hpp>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstddef>
#include <vector>

namespace jfpx {
namespace {

using ::testing::HasSubstr;

TEST(Backends, RowsComeInAFixedOrderAndExplainThemselves) {
  const std::vector<BackendStatus> rows = available_backends();
  ASSERT_EQ(rows.size(), 2u);
  EXPECT_EQ(rows[0].backend, Backend::cpu);
  EXPECT_EQ(rows[1].backend, Backend::cuda);
  EXPECT_TRUE(rows[0].compiled && rows[0].usable);
  for (const BackendStatus& row : rows) {
    EXPECT_EQ(row.usable, row.reason.empty()) << to_string(row.backend);
    EXPECT_TRUE(row.compiled || !row.usable);
    EXPECT_NE(row.device.empty(), row.usable);
  }
}

TEST(Backends, CudaIsCompiledAccordingToTheBuild) {
  EXPECT_EQ(available_backends()[1].compiled, bool{JFPX_HAS_CUDA});
  if (!JFPX_HAS_CUDA) {
    EXPECT_EQ(available_backends()[1].reason, "built without CUDA");
  }
}

TEST(Backends, NamesRoundTrip) {
  for (const Backend backend : {Backend::automatic, Backend::cpu, Backend::cuda}) {
    EXPECT_EQ(parse_backend(to_string(backend)), backend);
  }
  EXPECT_FALSE(parse_backend("vulkan").has_value());
  EXPECT_FALSE(parse_backend("").has_value());
}

TEST(Backends, AutomaticIsNeverAnError) {
  EXPECT_NO_THROW(make_sphere_collider());
  EXPECT_EQ(make_sphere_collider({.backend = Backend::cpu})->backend(), Backend::cpu);
}

TEST(Backends, AnUnusableBackendAskedForByNameGivesTheReason) {
  const BackendStatus cuda = available_backends()[1];
  if (cuda.usable) GTEST_SKIP() << "CUDA is usable here: " << cuda.device;
  try {
    make_sphere_collider({.backend = Backend::cuda});
    FAIL();
  } catch (const BackendUnavailable& error) {
    EXPECT_THAT(error.what(), HasSubstr("cuda: " + cuda.reason));
  }
}

TEST(Backends, BadOptionsAreNamed) {
  try {
    make_sphere_collider({.threads = 257});
    FAIL();
  } catch (const InvalidArgument& error) {
    EXPECT_THAT(error.what(), HasSubstr("threads is 257"));
  }
  EXPECT_THROW(make_sphere_collider({.backend = static_cast<Backend>(9)}), InvalidArgument);
}

TEST(Backends, GpusAreListedWithTheirLinks) {
  const std::vector<Gpu> gpus = available_gpus();
  bool is_usable = false;
  for (const BackendStatus& status : available_backends()) {
    is_usable = is_usable || (status.backend == Backend::cuda && status.usable);
  }
  EXPECT_EQ(!gpus.empty() && gpus[0].usable, is_usable);
  for (std::size_t i = 0; i < gpus.size(); ++i) {
    EXPECT_EQ(gpus[i].number, static_cast<int>(i));
    EXPECT_EQ(gpus[i].usable, gpus[i].reason.empty());
    for (const int other : gpus[i].linked) {
      EXPECT_NE(other, gpus[i].number);
      const std::vector<int>& back = gpus.at(static_cast<std::size_t>(other)).linked;
      EXPECT_EQ(std::ranges::count(back, gpus[i].number), 1) << i << " and " << other;
    }
  }
}

}  // namespace
}  // namespace jfpx
