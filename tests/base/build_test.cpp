/// Programs of other headers are refused, and told why.
#include <jfpx/build.hpp>
#include <jfpx/error.hpp>
#include <jfpx/particle.hpp>
#include <jfpx/world.hpp>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace jfpx {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

constexpr std::size_t kLayout = sizeof(detail::LayoutProbe);

Build other(std::uint64_t major, std::uint64_t minor, std::size_t real, std::size_t layout) {
  return Build{detail::pack_build(major, minor, real, layout)};
}

std::string complaint_about(Build headers) {
  try {
    verify_build(headers);
  } catch (const BuildMismatch& error) {
    return error.what();
  }
  return "accepted";
}

TEST(BuildCheck, AcceptsItsOwnHeaders) {
  EXPECT_NO_THROW(verify_build());
  EXPECT_EQ(complaint_about(other(JFPX_VERSION_MAJOR, JFPX_VERSION_MINOR, sizeof(Real), kLayout)),
            "accepted");
}

TEST(BuildCheck, NamesBothSidesWhateverDiffers) {
  const std::string precision = sizeof(Real) == sizeof(float) ? "float" : "double";
  const std::string other_precision = sizeof(Real) == sizeof(float) ? "double" : "float";
  const std::string library = "but the library is jfpx " + std::to_string(JFPX_VERSION_MAJOR) +
                              "." + std::to_string(JFPX_VERSION_MINOR) + " in " + precision;
  EXPECT_THAT(complaint_about(other(3, JFPX_VERSION_MINOR, sizeof(Real), kLayout)),
              AllOf(HasSubstr("headers of jfpx 3."), HasSubstr(library)));
  EXPECT_THAT(complaint_about(other(JFPX_VERSION_MAJOR, 77, sizeof(Real), kLayout)),
              AllOf(HasSubstr(".77 in " + precision), HasSubstr(library)));
  EXPECT_THAT(
      complaint_about(other(JFPX_VERSION_MAJOR, JFPX_VERSION_MINOR, 12 - sizeof(Real), kLayout)),
      AllOf(HasSubstr(" in " + other_precision + ", layout"), HasSubstr(library)));
  EXPECT_THAT(
      complaint_about(other(JFPX_VERSION_MAJOR, JFPX_VERSION_MINOR, sizeof(Real), kLayout + 32)),
      AllOf(HasSubstr("layout " + std::to_string(kLayout + 32)), HasSubstr(library)));
}

TEST(BuildCheck, IsDoneWhereverAColliderIsMade) {
  SphereColliderOptions options;
  EXPECT_NO_THROW(make_sphere_collider(options));
  options.headers = other(JFPX_VERSION_MAJOR, JFPX_VERSION_MINOR + 1, sizeof(Real), kLayout);
  EXPECT_THROW(make_sphere_collider(options), BuildMismatch);
  EXPECT_THROW(World(Scene{}, {.collider = options}), BuildMismatch);
  EXPECT_THROW(ParticleWorld({.collider = options}), BuildMismatch);
}

}  // namespace
}  // namespace jfpx
