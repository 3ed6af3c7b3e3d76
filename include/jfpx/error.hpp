/// The exceptions of jfpx. All derive from jfpx::Error, itself a std::runtime_error.
#pragma once

#include <jfpx/config.hpp>

#include <stdexcept>

namespace jfpx {
inline namespace JFPX_ABI {

/// Base of all errors that jfpx throws by itself. The message is a sentence for a user.
class JFPX_API Error : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
  ~Error() override;
};

/// A scene, or a scene file, that can't be simulated. Names body, field, value and allowed range.
class JFPX_API InvalidScene : public Error {
 public:
  using Error::Error;
  ~InvalidScene() override;
};

/// An argument out of its range. Names argument, value and allowed range.
class JFPX_API InvalidArgument : public Error {
 public:
  using Error::Error;
  ~InvalidArgument() override;
};

/// A backend was asked for by name and can't be used. The message gives the reason.
class JFPX_API BackendUnavailable : public Error {
 public:
  using Error::Error;
  ~BackendUnavailable() override;
};

/// Memory ran out. The message says how many bytes were needed, and for what. Where a small
/// allocation fails it is std::bad_alloc, as anywhere in C++: who means to go on catches both.
class JFPX_API OutOfMemory : public Error {
 public:
  using Error::Error;
  ~OutOfMemory() override;
};

/// A CUDA call failed. The message has the call, file:line and CUDA's name of the error.
class JFPX_API DeviceError : public Error {
 public:
  using Error::Error;
  ~DeviceError() override;
};

/// The program was compiled with the headers of another jfpx than the library: see verify_build().
class JFPX_API BuildMismatch : public Error {
 public:
  using Error::Error;
  ~BuildMismatch() override;
};

/// A file could not be read or written, is truncated, or is corrupt.
class JFPX_API FileError : public Error {
 public:
  using Error::Error;
  ~FileError() override;
};

}  // namespace JFPX_ABI
}  // namespace jfpx
