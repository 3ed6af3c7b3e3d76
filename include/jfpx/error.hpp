/// The exceptions of jfpx. All derive from jfpx::Error, which derives from std::runtime_error.
#pragma once

#include <jfpx/config.hpp>

#include <stdexcept>

namespace jfpx {
inline namespace JFPX_ABI {

/// Base class of all exceptions of jfpx. The message is a sentence for the user.
class JFPX_API Error : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
  ~Error() override;
};

/// A scene or scene file that can't be simulated. The message names the body, the field, its value
/// and the allowed range.
class JFPX_API InvalidScene : public Error {
 public:
  using Error::Error;
  ~InvalidScene() override;
};

/// An argument out of range. The message names the argument, its value and the allowed range.
class JFPX_API InvalidArgument : public Error {
 public:
  using Error::Error;
  ~InvalidArgument() override;
};

/// A snapshot that a world can't restore: truncated, corrupt, of another format or precision, or
/// of a world with other callbacks. The message gives the reason.
class JFPX_API InvalidSnapshot : public Error {
 public:
  using Error::Error;
  ~InvalidSnapshot() override;
};

/// A backend was requested explicitly and can't be used. The message gives the reason.
class JFPX_API BackendUnavailable : public Error {
 public:
  using Error::Error;
  ~BackendUnavailable() override;
};

/// An allocation failed. The message gives the number of bytes and their purpose. Small allocations
/// fail with std::bad_alloc instead, so callers that recover must catch both.
class JFPX_API OutOfMemory : public Error {
 public:
  using Error::Error;
  ~OutOfMemory() override;
};

/// A CUDA call failed. The message contains the call, its file and line, and CUDA's error name.
class JFPX_API DeviceError : public Error {
 public:
  using Error::Error;
  ~DeviceError() override;
};

/// A file can't be read or written, is truncated, or is corrupt.
class JFPX_API FileError : public Error {
 public:
  using Error::Error;
  ~FileError() override;
};

}  // namespace JFPX_ABI
}  // namespace jfpx
