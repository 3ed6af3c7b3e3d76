/// Statistics of a jfpx::bullet::CollisionDispatcher.
#pragma once

#include <jfpx/config.hpp>

#include <array>
#include <cstdint>
#include <string>
#include <string_view>

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {

/// Reason why an entire dispatch ran in Bullet's own code. The bits are identical either way.
enum class Fallback : std::uint8_t {
  none,
  small_batch,    ///< fewer pairs than minimum_batch
  no_spheres,     ///< fewer than two spheres, fewer than 64 pairs with concave shapes, compounds or
                  ///< convex shapes that GJK tests, and one thread
  near_callback,  ///< the user has set a near callback that does not call
                  ///< CollisionDispatcher::defaultNearCallback()
  create_function,  ///< the user has registered another SPHERE/SPHERE create function
  continuous,       ///< m_dispatchFunc is not DISPATCH_DISCRETE
  nested,           ///< called by a callback inside another dispatch of this dispatcher
  out_of_memory,    ///< see DispatchStats::failure; the next dispatch tries again
  rounding,         ///< the rounding mode of the thread is not to nearest
};
inline constexpr std::size_t kFallbackCount = 9;

/// A short text for a table, for example "small batch".
JFPX_BULLET_API std::string_view to_string(Fallback fallback) noexcept;

/// Reason why a batch updated the manifolds in Bullet's order on one thread, which is slower. The
/// bits are identical either way. The first reason that applies is counted.
enum class OrderReason : std::uint8_t {
  none,                ///< any order, on all threads
  combine_callback,    ///< the user combines materials; Bullet computes all contacts
  contact_callback,    ///< contact started, ended or destroyed is set
  processed_callback,  ///< contact processed is set
  added_callback,      ///< contact added is set, and a body has CF_CUSTOM_MATERIAL_CALLBACK
  filter,              ///< the class of the dispatcher or of a body may override a filter
  pair_cache,          ///< the pair cache is not exactly a btHashedOverlappingPairCache
  near_callback,       ///< a near callback calls CollisionDispatcher::defaultNearCallback()
};
inline constexpr std::size_t kOrderReasonCount = 8;

/// A short text for a table, for example "contact callback".
JFPX_BULLET_API std::string_view to_string(OrderReason reason) noexcept;

/// Reason why Bullet processed a pair of a convex and a concave shape on one thread. The bits are
/// identical either way.
enum class ConcaveFallback : std::uint8_t {
  none,
  concave_class,    ///< not exactly Bullet's triangle mesh, scaled mesh or height field
  convex_class,     ///< not exactly one of Bullet's classes, or one that may have own state
  create_function,  ///< the user has registered another create function for triangles
  separating_axes,  ///< m_enableSatConvex, and a polyhedral shape
  not_finite,       ///< a coordinate is infinite, NaN or very large
  verified,         ///< set_verify(true), and a shape other than a sphere
};
inline constexpr std::size_t kConcaveFallbackCount = 7;

/// A short text for a table, for example "class of the concave shape".
JFPX_BULLET_API std::string_view to_string(ConcaveFallback fallback) noexcept;

/// Counters since construction or reset_stats(). Pairs are counted only in batches; a batch without
/// active bodies changes no manifold and counts only `pairs`.
struct DispatchStats {
  std::uint64_t dispatches = 0;     ///< calls of dispatchAllCollisionPairs
  std::uint64_t batches = 0;        ///< dispatches that were computed by the collider
  std::uint64_t pairs = 0;          ///< overlapping pairs
  std::uint64_t sphere_pairs = 0;   ///< pairs of two spheres
  std::uint64_t touching = 0;       ///< sphere pairs that the collider reported as touching
  std::uint64_t written = 0;        ///< sphere pairs updated without Bullet's algorithm
  std::uint64_t sphere_boxes = 0;   ///< sphere-box pairs updated without Bullet's algorithm
  std::uint64_t sphere_planes = 0;  ///< sphere-plane pairs updated without Bullet's algorithm
  std::uint64_t convex_pairs = 0;   ///< other pairs of convex shapes and planes, on any thread
  std::uint64_t sphere_concaves =
      0;  ///< spheres on meshes and height fields, without Bullet's algorithm
  std::uint64_t concave_pairs = 0;   ///< other shapes on meshes and height fields, on any thread
  std::uint64_t compound_pairs = 0;  ///< pairs with compounds, without Bullet's compound algorithms
  std::uint64_t verified = 0;        ///< pairs recomputed because of set_verify(true)
  std::uint64_t mismatches = 0;      ///< verified pairs that differ in any field
  std::string first_mismatch;        ///< field and both values; empty without a mismatch
  std::array<std::uint64_t, kFallbackCount> fallbacks{};  ///< dispatches by Fallback
  Fallback last_fallback = Fallback::none;                ///< `none` if the last was a batch
  std::array<std::uint64_t, kOrderReasonCount>
      ordered{};  ///< batches by OrderReason; `none` counts the unordered ones
  OrderReason last_order = OrderReason::none;  ///< of the last batch
  std::array<std::uint64_t, kConcaveFallbackCount>
      concave_fallbacks{};        ///< unobserved pairs by ConcaveFallback
  std::uint64_t to_device = 0;    ///< bytes that the collider sent to a device
  std::uint64_t from_device = 0;  ///< bytes that the collider received from a device
  std::string failure;            ///< error of the last dispatch that ran out of memory
  std::string device_failure;     ///< why the CPU replaced the device; empty if it has not
  std::string warning;            ///< set if the program fuses products and sums; see fused.hpp
  double prepare_ms = 0;          ///< wall clock of batches: gather, collider, read manifolds
  double commit_ms = 0;           ///< wall clock of batches: update of the manifolds
};

}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
