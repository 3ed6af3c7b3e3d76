/// A scene: bodies and settings as a plain value that any engine can run, and its JSON form.
#pragma once

#include <jfpx/body.hpp>
#include <jfpx/material.hpp>

#include <string>
#include <string_view>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {

/// Settings of the native contact resolver (thesis 4.4.6).
struct ResolverSettings {
  /// Most contacts corrected per step in each loop; 0 means 8 per movable body, as the thesis did.
  std::uint32_t max_iterations = 0;
  Real velocity_epsilon = Real(0.01);      ///< [m/s], > 0: smaller closing changes are left alone
  Real position_epsilon = Real(0.01);      ///< [m], > 0: deeper penetrations are brought below it
  Real restitution_velocity = Real(0.25);  ///< [m/s], >= 0: slower contacts do not bounce
  Real angular_limit = Real(0.2);  ///< [rad], in (0, 1]: how far one projection may turn a body
  friend bool operator==(const ResolverSettings&, const ResolverSettings&) = default;
};

/// Settings of the native sleep test (thesis 4.4.2).
struct SleepSettings {
  bool enabled = true;
  Real epsilon = Real(0.3);  ///< [m^2/s^2], > 0: a body sleeps when its mean motion is below
  Real bias = Real(0.05);    ///< [-], in (0, 1]: weight that one second leaves to the old mean
  friend bool operator==(const SleepSettings&, const SleepSettings&) = default;
};

struct Scene {
  std::string name = "unnamed";
  Real dt = Real(1) / Real(60);  ///< [s], > 0: length of a step
  std::vector<BodyDef> bodies;
  ResolverSettings resolver;
  SleepSettings sleep;
  MaterialSettings materials;
  friend bool operator==(const Scene&, const Scene&) = default;
};

/// Version of the JSON form that to_json() writes; from_json() reads this one.
inline constexpr int kSceneSchemaVersion = 1;
/// Largest distance from the origin, per axis, that a position may have: [m].
inline constexpr Real kMaxCoordinate = Real(1e9);
/// How far from 1 the square of the length of a unit vector or quaternion may be: enough for
/// numbers typed with four digits. Engines normalise what they are given.
inline constexpr Real kUnitTolerance = Real(1e-3);

/// Checks everything that could reach a step. Returns normally if the scene is sound. Besides the
/// ranges given with the fields: sizes, positions and offsets are at most kMaxCoordinate, masses
/// and moments of inertia have finite inverses, dt is not denormal, 2^32 - 1 bodies at most.
/// @throws InvalidScene naming the first bad body, field, its value and the allowed range.
JFPX_API void validate(const Scene& scene);

/// The scene as JSON text. Numbers are written so that from_json() gives back the same bits. What
/// is no UTF-8 in the name becomes U+FFFD.
JFPX_API std::string to_json(const Scene& scene);
/// Parses and validates.
/// @throws InvalidScene: broken JSON (with line and column), unknown or missing field, wrong type,
///   unknown schema version or shape, value out of range.
JFPX_API Scene from_json(std::string_view text);

/// @throws FileError if the file can't be read, and as from_json(), with the path in front.
JFPX_API Scene load_scene(const std::string& path);
/// Writes to_json() to the path, all or nothing. @throws FileError
JFPX_API void save_scene(const Scene& scene, const std::string& path);

}  // namespace JFPX_ABI
}  // namespace jfpx
