/// Contact search among spheres: the narrow phase of the thesis, which runs on the GPU (thesis
/// 4.5).
#pragma once

#include <jfpx/backend.hpp>
#include <jfpx/build.hpp>
#include <jfpx/contact.hpp>
#include <jfpx/cost_model.hpp>
#include <jfpx/simd_level.hpp>

#include <memory>
#include <span>
#include <string_view>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {

/// Algorithm that finds pairs of spheres. All algorithms produce bitwise identical contacts.
enum class SphereAlgorithm : std::uint8_t {
  automatic,
  all_pairs,  ///< tests every pair: fastest for up to some hundreds of spheres
  grid,       ///< sorts the spheres into grid cells and tests neighbouring cells only
};

/// Returns "automatic", "all pairs" or "grid".
JFPX_API std::string_view to_string(SphereAlgorithm algorithm) noexcept;

/// Reason for the backend and algorithm of a call. The results do not depend on it.
enum class ChoiceReason : std::uint8_t {
  fixed,          ///< requested by name, or the only usable choice
  predicted,      ///< predicted to be the fastest by the cost model
  measured,       ///< measured to be the fastest in the last calls
  kept,           ///< another may be faster, but not by enough to switch
  trial,          ///< executed for a few calls to measure its time
  device_failed,  ///< the device failed, in this call or an earlier one
};
/// Returns a short text for tables, for example "device failed".
JFPX_API std::string_view to_string(ChoiceReason reason) noexcept;

/// Options of make_sphere_collider(). Backend::automatic selects backend and algorithm for each
/// call from `costs` and from the times of recent calls. If CUDA is unavailable, it selects the
/// CPU. If the device fails or runs out of memory, the CPU replaces it permanently and produces the
/// same bits. CUDA initialization takes some tenths of a second unless available_backends() was
/// called before. `automatic` initializes CUDA on another thread while the CPU computes (see
/// CostModel::cuda_start_ms); `cuda` initializes it in make_sphere_collider().
struct SphereColliderOptions {
  Backend backend = Backend::automatic;
  SphereAlgorithm algorithm = SphereAlgorithm::automatic;
  unsigned threads = 1;                   ///< cpu: number of threads, at most 256; 0: one per core
  SimdLevel simd = SimdLevel::automatic;  ///< cpu: widest vector instructions, also of a World
  int device = 0;                         ///< cuda: ordinal of the GPU
  CostModel costs = {};                   ///< automatic: predicted costs
};

/// Bytes that a call copied between host and device memory.
struct TransferredBytes {
  std::uint64_t to_device = 0, from_device = 0;
};

/// Finds contacts among spheres. Owns its buffers, which grow and never shrink. Calls on one object
/// are not thread-safe; different objects may be used concurrently. Results do not depend on the
/// backend, the algorithm, the number of threads or the vector width, and are valid until the next
/// call on the same object.
class JFPX_API SphereCollider {
 public:
  virtual ~SphereCollider();
  SphereCollider(const SphereCollider&) = delete;
  SphereCollider& operator=(const SphereCollider&) = delete;

  /// Finds all touching pairs among `spheres`, sorted by (a, b). The number of contacts is limited
  /// only by memory.
  /// @param spheres at most 2^32 - 1 (on a GPU 2^31), with finite centres and finite radii
  ///   > 0 [m]
  /// @throws InvalidArgument if a value is not finite or a radius is not > 0; the message names the
  ///   first such sphere and field. OutOfMemory with the number of bytes; DeviceError. The collider
  ///   stays usable after any of them.
  virtual ContactSpan find_contacts(std::span<const SphereInstance> spheres) = 0;

  /// Finds the pairs of find_contacts() as indices alone, which takes less time on the CPU.
  /// @throws as find_contacts(); std::bad_alloc
  virtual std::span<const SpherePair> find_pairs(std::span<const SphereInstance> spheres);

  /// Finds the touching pairs of a list, in the order of the list. Intended for the pairs of a
  /// broad phase, few of which touch. Reproduces Bullet's btSphereSphereCollisionAlgorithm for all
  /// values: a NaN results in a contact, and no value is rejected.
  /// @throws InvalidArgument if an index in `pairs` is out of range, or for 2^32 pairs or more;
  ///   OutOfMemory; DeviceError. The collider stays usable after any of them.
  virtual std::span<const PairContact> find_touching(std::span<const SphereInstance> spheres,
                                                     std::span<const SpherePair> pairs) = 0;

  /// Bytes copied by the last find_touching(). For a list similar to that of the previous call,
  /// only the differences are copied to the device. Zero on the CPU.
  virtual TransferredBytes transferred() const noexcept { return {}; }

  /// Backend that computed the last call; for a fixed backend, that backend.
  virtual Backend backend() const noexcept = 0;
  /// Algorithm of the last find_contacts(); `automatic` before the first call.
  virtual SphereAlgorithm algorithm() const noexcept = 0;
  /// Reason for the backend and algorithm of the last call.
  virtual ChoiceReason reason() const noexcept { return ChoiceReason::fixed; }
  /// Error message if the device failed in the last call and the CPU computed the result; otherwise
  /// empty.
  virtual std::string_view device_failure() const noexcept { return {}; }

 protected:
  SphereCollider() = default;

 private:
  std::vector<SpherePair> pairs_of_contacts_;
};

/// Creates a collider. Thread-safe.
/// @throws BackendUnavailable if `options.backend` is cpu or cuda and is unavailable;
///   InvalidArgument for an invalid option.
JFPX_API std::unique_ptr<SphereCollider> make_sphere_collider(
    const SphereColliderOptions& options = {});

}  // namespace JFPX_ABI
}  // namespace jfpx
