/// Which parts of the machine can compute, and which cannot and why.
#pragma once

#include <jfpx/config.hpp>

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {

/// Who computes. All give the same bits, so `automatic` is free to choose.
enum class Backend : std::uint8_t { automatic, cpu, cuda };

/// One row of the backend table.
struct BackendStatus {
  Backend backend = Backend::cpu;
  bool compiled = false;  ///< this build contains it
  bool usable = false;    ///< it can run here and now
  std::string device;     ///< the processor or GPU; empty where unknown
  std::string reason;     ///< why it is not usable; empty where it is
};

/// All backends that jfpx knows, in a fixed order, probed now. Never throws for a missing device
/// and leaves no CUDA error behind. Where there is a GPU, the first call starts CUDA, which takes
/// some tenths of a second: `automatic` would do so in the call that first uses the GPU.
/// Thread-safe.
JFPX_API std::vector<BackendStatus> available_backends();

/// "auto", "cpu" or "cuda".
JFPX_API std::string_view to_string(Backend backend) noexcept;
/// The inverse of to_string(); empty for any other text. Also accepts "x86", the name of
/// Backend::cpu in version 0.1.
JFPX_API std::optional<Backend> parse_backend(std::string_view text) noexcept;

}  // namespace JFPX_ABI
}  // namespace jfpx
