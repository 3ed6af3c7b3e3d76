/// What a jfpx::bullet::CollisionDispatcher did so far.
#pragma once

#include <jfpx/config.hpp>

#include <array>
#include <cstdint>
#include <string>
#include <string_view>

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {

/// Why a dispatch was left to Bullet's own code as a whole. The bits are the same either way.
enum class Fallback : std::uint8_t {
  none,
  small_batch,      ///< fewer pairs than minimum_batch
  no_spheres,       ///< no two spheres among the bodies of the pairs
  near_callback,    ///< the user set a near callback
  create_function,  ///< the user registered another SPHERE/SPHERE create function
  continuous,       ///< dispatchFunc is not DISPATCH_DISCRETE
  nested,           ///< called from a callback inside another dispatch of this dispatcher
  out_of_memory,    ///< see DispatchStats::failure; the next dispatch tries again
};
inline constexpr std::size_t kFallbackCount = 8;

/// A short text for a table, for example "small batch".
JFPX_API std::string_view to_string(Fallback fallback) noexcept;

/// Counters since construction or reset_stats(). Pairs are counted in batches only.
struct DispatchStats {
  std::uint64_t dispatches = 0;     ///< calls of dispatchAllCollisionPairs
  std::uint64_t batches = 0;        ///< of these, computed by the collider
  std::uint64_t pairs = 0;          ///< overlapping pairs
  std::uint64_t sphere_pairs = 0;   ///< of these, between two spheres
  std::uint64_t touching = 0;       ///< of these, found touching by the collider
  std::uint64_t written = 0;        ///< of these, brought up to date without Bullet's algorithm
  std::uint64_t sphere_boxes = 0;   ///< pairs of a sphere and a box, likewise
  std::uint64_t sphere_planes = 0;  ///< pairs of a sphere and a plane, likewise
  std::uint64_t verified = 0;       ///< pairs recomputed by set_verify(true)
  std::uint64_t mismatches = 0;     ///< of these, different in any field
  std::string first_mismatch;       ///< field and both values; empty where there was none
  std::array<std::uint64_t, kFallbackCount> fallbacks{};  ///< dispatches by Fallback
  Fallback last_fallback = Fallback::none;                ///< none where the last was a batch
  std::uint64_t to_device = 0;    ///< bytes that the collider sent to a device
  std::uint64_t from_device = 0;  ///< bytes that it got back
  std::string failure;            ///< what the last dispatch wanted that ran out of memory
  std::string device_failure;     ///< why x86 took over from the device, if it did
  std::string warning;            ///< that this program does not have Bullet's bits; see fused.hpp
  double prepare_ms = 0;          ///< wall clock of batches: gathering, collider, reading manifolds
  double commit_ms = 0;           ///< wall clock of batches: the ordered walk
};

}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
