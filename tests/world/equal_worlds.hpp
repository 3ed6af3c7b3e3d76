/// Steps of two worlds, and comparisons of them.
#pragma once

#include <jfpx/world.hpp>

#include <gtest/gtest.h>

#include <cstdint>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace test {

/// @returns the report of the last step
inline StepReport make_steps(World* world, std::uint64_t count) {
  StepReport report;
  for (; count > 0; --count) report = world->step();
  return report;
}

inline void expect_equal(const StepReport& host, const StepReport& device) {
  ASSERT_EQ(host.step, device.step);
  ASSERT_EQ(host.contacts, device.contacts);
  ASSERT_EQ(host.sphere_contacts, device.sphere_contacts);
  ASSERT_EQ(host.awake, device.awake);
  ASSERT_EQ(host.non_finite, device.non_finite);
}
inline void expect_equal_contacts(const World& host, const World& device) {
  const auto a = host.contacts(), b = device.contacts();
  ASSERT_EQ(std::vector(a.begin(), a.end()), std::vector(b.begin(), b.end()));
  const auto c = host.contact_events(), d = device.contact_events();
  ASSERT_EQ(std::vector(c.begin(), c.end()), std::vector(d.begin(), d.end()));
  const auto e = host.hit_events(), f = device.hit_events();
  ASSERT_EQ(std::vector(e.begin(), e.end()), std::vector(f.begin(), f.end()));
}

/// Copies the contacts of the solver from a device, so that later steps have them on the host.
inline void expect_equal_forces(const World& host, const World& device) {
  const auto a = host.contact_forces(), b = device.contact_forces();
  ASSERT_EQ(std::vector(a.begin(), a.end()), std::vector(b.begin(), b.end()));
}

}  // namespace test
}  // namespace JFPX_ABI
}  // namespace jfpx
