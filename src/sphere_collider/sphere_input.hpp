/// Validation of the inputs of sphere colliders, with the same messages for all backends.
#pragma once

#include <jfpx/contact.hpp>
#include <jfpx/error.hpp>

#include "src/base/parallel_for.hpp"

#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <functional>
#include <limits>
#include <span>
#include <string>

namespace jfpx {
inline namespace JFPX_ABI {
namespace detail {

/// Formats a value for a message, e.g. -1 or 1e+30.
inline std::string to_text(Real value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.9g", static_cast<double>(value));
  return text;
}

inline bool is_valid(const SphereInstance& s) {
  return is_finite(s.centre) && is_finite(s.radius) && s.radius > 0;
}

/// @throws InvalidArgument with the first invalid sphere and field. If all spheres are valid now,
/// the message reports that the caller has changed them during the search.
[[noreturn]] inline void reject_sphere(std::span<const SphereInstance> spheres) {
  const auto bad = std::find_if_not(spheres.begin(), spheres.end(), is_valid);
  if (bad == spheres.end()) throw InvalidArgument("a sphere was invalid when it was read");
  const std::string sphere = "sphere " + std::to_string(bad - spheres.begin()) + ": ";
  for (int i = 0; i < 3; ++i) {
    if (is_finite(bad->centre[i])) continue;
    throw InvalidArgument(sphere + "centre." + "xyz"[i] + " is " + to_text(bad->centre[i]) +
                          "; it must be finite");
  }
  throw InvalidArgument(sphere + "radius is " + to_text(bad->radius) +
                        "; it must be finite and > 0");
}

/// Returns whether all centres are finite and all radii are finite and > 0. Compares the four
/// values of a sphere at a time with the compiler's vector types, which use baseline instructions.
/// The time is about that of loading the spheres.
inline bool all_valid(std::span<const SphereInstance> spheres) {
  using Quad [[gnu::vector_size(4 * sizeof(Real)), gnu::may_alias]] = Real;
  constexpr Real kMax = std::numeric_limits<Real>::max();
  const Quad low = {-kMax, -kMax, -kMax, std::numeric_limits<Real>::denorm_min()};
  const Quad high = {kMax, kMax, kMax, kMax};
  auto good = low <= high;
  for (const SphereInstance& s : spheres) {
    const Quad v = reinterpret_cast<const Quad&>(s);
    good &= (v >= low) & (v <= high);
  }
  return (good[0] & good[1] & good[2] & good[3]) != 0;
}

/// @throws InvalidArgument if the number of spheres exceeds the range of SphereIndex.
inline void check_count(std::span<const SphereInstance> spheres) {
  constexpr std::size_t kMax = std::numeric_limits<SphereIndex>::max();
  if (spheres.size() > kMax) {
    throw InvalidArgument("number of spheres is " + std::to_string(spheres.size()) +
                          "; it must be at most " + std::to_string(kMax));
  }
}

/// @throws InvalidArgument if there are too many spheres, or with the first sphere and field that
/// is invalid for find_contacts()
/// @param pool null: in the calling thread
inline void check_spheres(std::span<const SphereInstance> spheres, ThreadPool* pool = nullptr) {
  constexpr std::size_t kSpheresPerChunk = 8192;
  check_count(spheres);
  const bool valid = parallel_reduce(
      pool, spheres.size(), kSpheresPerChunk, true,
      [&](std::size_t first, std::size_t last) {
        return all_valid(spheres.subspan(first, last - first));
      },
      std::logical_and<>());
  if (!valid) reject_sphere(spheres);
}

/// @throws InvalidArgument if the number of pairs exceeds the range of PairContact::pair.
inline void check_count(std::span<const SpherePair> pairs) {
  constexpr std::size_t kMax = std::numeric_limits<std::uint32_t>::max();
  if (pairs.size() > kMax) {
    throw InvalidArgument("number of pairs is " + std::to_string(pairs.size()) +
                          "; it must be at most " + std::to_string(kMax));
  }
}

/// @param items what the systems consist of, in messages
/// @throws InvalidArgument unless the offsets of systems ascend from 0 to the number of items.
inline void check_offsets(std::span<const std::uint64_t> offsets, std::size_t count,
                          const std::string& items = "spheres") {
  if (offsets.empty() || offsets.front() != 0) {
    throw InvalidArgument("offsets must begin with 0");
  }
  for (std::size_t i = 1; i < offsets.size(); ++i) {
    if (offsets[i] < offsets[i - 1]) {
      throw InvalidArgument("offset " + std::to_string(i) + " is " + std::to_string(offsets[i]) +
                            "; it must be at least the offset before, " +
                            std::to_string(offsets[i - 1]));
    }
  }
  if (offsets.back() != count) {
    throw InvalidArgument("the last offset is " + std::to_string(offsets.back()) +
                          "; it must be the number of " + items + ", " + std::to_string(count));
  }
}

/// @throws InvalidArgument with the first pair that has an index >= `spheres`.
[[noreturn]] inline void reject_pair(std::span<const SpherePair> pairs, std::size_t spheres) {
  const auto bad = std::find_if(pairs.begin(), pairs.end(), [&](const SpherePair& p) {
    return p.a >= spheres || p.b >= spheres;
  });
  const bool a_is_bad = bad->a >= spheres;
  throw InvalidArgument("pair " + std::to_string(bad - pairs.begin()) + ": " +
                        (a_is_bad ? "a" : "b") + " is " +
                        std::to_string(a_is_bad ? bad->a : bad->b) +
                        "; it must be less than the number of spheres, " + std::to_string(spheres));
}

}  // namespace detail
}  // namespace JFPX_ABI
}  // namespace jfpx
