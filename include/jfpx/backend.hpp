/// Computing devices, their availability, and the reason if a device is unavailable.
#pragma once

#include <jfpx/config.hpp>

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {

/// Computing device. All backends produce identical bits, so `automatic` may select any of them.
enum class Backend : std::uint8_t { automatic, cpu, cuda };

/// Status of a backend.
struct BackendStatus {
  Backend backend = Backend::cpu;
  bool compiled = false;  ///< the build includes it
  bool usable = false;    ///< it can be used on this machine now
  std::string device;     ///< name of the processor or GPU; empty if unknown
  std::string reason;     ///< why it is unusable; empty if it is usable
};

/// Probes all backends and returns their status in a fixed order: cpu, cuda. Does not throw for a
/// missing device and leaves no CUDA error pending. If there is a GPU, the first call initializes
/// CUDA, which takes some tenths of a second; without this call, `automatic` initializes CUDA on
/// another thread. Thread-safe.
JFPX_API std::vector<BackendStatus> available_backends();

/// A GPU of this machine.
struct Gpu {
  int number = 0;    ///< for SphereColliderOptions::device
  std::string name;  ///< with the compute capability and the memory
  bool usable = false;
  std::string reason;  ///< why it is unusable; empty if it is usable
  /// Numbers of the usable GPUs whose memory it can access, and which can access its memory, by a
  /// link with atomic operations, such as NVLink.
  std::vector<int> linked;
};

/// The GPUs of this machine, by number; empty without a driver or in a build without CUDA. As
/// available_backends(), it does not throw for an unusable GPU. Initializes CUDA on each of them,
/// which takes some tenths of a second and some hundred MB of its memory. Thread-safe.
JFPX_API std::vector<Gpu> available_gpus();

/// Returns "auto", "cpu" or "cuda".
JFPX_API std::string_view to_string(Backend backend) noexcept;
/// Inverse of to_string(); empty for any other text. Also accepts "x86", the name of
/// Backend::cpu in version 0.1.
JFPX_API std::optional<Backend> parse_backend(std::string_view text) noexcept;

}  // namespace JFPX_ABI
}  // namespace jfpx
