/// Finds touching spheres: the narrowphase that the thesis moved to the GPU (thesis 4.5).
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

/// How pairs are found. All give the same contacts, bit for bit.
enum class SphereAlgorithm : std::uint8_t {
  automatic,
  all_pairs,     ///< every pair is looked at: best for some hundreds of spheres
  sorted_tiles,  ///< sorted into tiles of space, the cells of grids; only neighbours are looked at
};

/// "automatic", "all pairs" or "sorted tiles".
JFPX_API std::string_view to_string(SphereAlgorithm algorithm) noexcept;

/// Why a call was computed by whom it was. The bits do not depend on it.
enum class ChoiceReason : std::uint8_t {
  fixed,          ///< there was no choice: asked for by name, or nothing else is usable
  predicted,      ///< the cost model expects it to be the fastest
  measured,       ///< so do the times of the last calls
  kept,           ///< another may be faster, but by too little to switch
  trial,          ///< tried for a few calls, to learn how long it takes here
  device_failed,  ///< the device failed, in this call or an earlier one
};
/// A short text for a table, for example "device failed".
JFPX_API std::string_view to_string(ChoiceReason reason) noexcept;

/// With `Backend::automatic` backend and algorithm are chosen call by call, from `costs` and from
/// the times of the last calls. Where CUDA can't be had, x86 computes; when the device fails or its
/// memory does not suffice, x86 takes over for good, with the same bits. The call that first uses a
/// GPU starts CUDA, some tenths of a second, unless available_backends() was called before.
struct SphereColliderOptions {
  Build headers =
      Build::of_these_headers;  ///< leave it: tells the library what the caller includes
  Backend backend = Backend::automatic;
  SphereAlgorithm algorithm = SphereAlgorithm::automatic;
  unsigned threads = 1;                   ///< x86: worker threads, 0 = one per core, at most 256
  SimdLevel simd = SimdLevel::automatic;  ///< x86
  int device = 0;                         ///< cuda: ordinal of the GPU
  CostModel costs = {};                   ///< automatic: what is expected to be fast
};

/// Bytes that a call moved between the memories of host and device.
struct TransferredBytes {
  std::uint64_t to_device = 0, from_device = 0;
};

/// Finds contacts among spheres. Owns its buffers, which only grow; calls are not thread-safe, but
/// several colliders can be used by several threads. Results do not depend on backend, algorithm,
/// number of threads or vector width, and stay valid until the next call on the same object.
class JFPX_API SphereCollider {
 public:
  virtual ~SphereCollider();
  SphereCollider(const SphereCollider&) = delete;
  SphereCollider& operator=(const SphereCollider&) = delete;

  /// All touching pairs among `spheres`, sorted by (a, b). No pair is lost, whatever their number.
  /// @throws InvalidArgument if a value is not finite or a radius is not > 0: names the first such
  ///   sphere and field. OutOfMemory with the bytes needed, DeviceError: the collider stays usable.
  virtual ContactSpan find_contacts(std::span<const SphereInstance> spheres) = 0;

  /// Tests only the given pairs, in their order; result i belongs to pairs[i]. Follows Bullet's
  /// btSphereSphereCollisionAlgorithm for any values: a NaN makes a contact, nothing is rejected.
  /// @throws InvalidArgument if a pair names a sphere that is not there; OutOfMemory, DeviceError.
  virtual std::span<const PairResult> test_pairs(std::span<const SphereInstance> spheres,
                                                 std::span<const SpherePair> pairs) = 0;

  /// As test_pairs(), but only the pairs that touch, in their order. What most callers want: few
  /// of the pairs that a broad phase hands over do touch.
  /// @throws as test_pairs(); InvalidArgument for 2^32 pairs or more.
  virtual std::span<const PairContact> find_touching(std::span<const SphereInstance> spheres,
                                                     std::span<const SpherePair> pairs);

  /// What the last find_touching() moved; of a list that it knows from the call before, a device is
  /// told only what differs. Nothing on x86.
  virtual TransferredBytes transferred() const noexcept { return {}; }

  /// Who computed the last call (for a fixed backend: that backend).
  virtual Backend backend() const noexcept = 0;
  /// How pairs were found in the last find_contacts(); `automatic` before the first.
  virtual SphereAlgorithm algorithm() const noexcept = 0;
  /// Why the last call was computed so.
  virtual ChoiceReason reason() const noexcept { return ChoiceReason::fixed; }
  /// Why x86 has taken over from a device in the last call; empty after all other calls.
  virtual std::string_view device_failure() const noexcept { return {}; }

 protected:
  SphereCollider() = default;

 private:
  std::vector<PairContact> touching_;  ///< of find_touching(), where a class does not override it
};

/// @throws BackendUnavailable if `options.backend` is asked for by name and can't be had;
///   InvalidArgument for a bad option; BuildMismatch, see verify_build(). Thread-safe.
JFPX_API std::unique_ptr<SphereCollider> make_sphere_collider(
    const SphereColliderOptions& options = {});

}  // namespace JFPX_ABI
}  // namespace jfpx
