/// Comparison of native jfpx, stock Bullet and Bullet with jfpx on one scene.
#pragma once

#include "src/tool/engine.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace tool {

/// Results of a comparison. `stock` and `jfpx` are two Bullet worlds with different parts.
struct Comparison {
  /// Contacts of find_contacts() compared with the sphere-sphere manifolds of stock Bullet.
  std::uint64_t contacts_compared = 0;
  std::uint64_t contact_mismatches = 0;
  std::string first_contact_mismatch;  ///< description; empty if there is none
  /// The first difference between the two Bullet worlds. After each step, compares the manifolds in
  /// order with every field of every point, then the transforms and the velocities.
  std::string first_difference;
  std::uint64_t hash_native = 0, hash_stock = 0, hash_jfpx = 0;
  std::uint64_t contacts_native = 0, contacts_stock = 0, contacts_jfpx = 0;  ///< summed over steps
  StageTimes ms_native, ms_stock, ms_jfpx;                                   ///< summed over steps
  std::uint64_t batches = 0;           ///< dispatches of `jfpx` computed by its collider
  std::uint64_t groups = 0;            ///< simulation groups solved by the solver of `jfpx`
  std::uint64_t groups_on_device = 0;  ///< groups solved on the GPU
  std::string device_failure;          ///< reason why the CPU replaced the GPU; or empty
  std::string trouble;                 ///< reason why native could not continue; or empty
  std::string backend;                 ///< computed the last batch of sphere pairs in `jfpx`

  bool trajectory_identical() const { return first_difference.empty() && hash_stock == hash_jfpx; }
  bool passed() const { return contact_mismatches == 0 && trajectory_identical(); }
};

/// Steps the three engines side by side. @throws BackendUnavailable in a build without Bullet.
Comparison compare(const Scene& scene, const RunOptions& options);

}  // namespace tool
}  // namespace JFPX_ABI
}  // namespace jfpx
