/// Communication between the ranks of a world by an object of Python.
#pragma once

#include <jfpx/communicator.hpp>

#include "python/src/bindings.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace python {

/// Calls the methods of an object such as jfpx.mpi.Communicator, with Python's global lock.
/// Messages are views of the memory of C++, which are released at the end of each call.
class PythonCommunicator final : public Communicator {
 public:
  /// @param object outlives this one
  /// @param in_use true during the calls, in which other threads may run: they must not use the
  ///   world
  PythonCommunicator(nb::handle object, std::uint32_t rank, std::uint32_t size,
                     std::atomic<bool>* in_use)
      : object_(object), rank_(rank), size_(size), in_use_(in_use) {}

  std::uint32_t rank() const noexcept override { return rank_; }
  std::uint32_t size() const noexcept override { return size_; }
  /// The functions throw nb::python_error for an exception of a method, and for a message that is
  /// kept after its call. @throws InvalidArgument for a wrong number of messages
  void exchange(std::span<const Message> sent, std::span<Message> received) override;
  void exchange_sized(std::span<const std::span<const std::byte>> sent,
                      std::span<const std::span<std::byte>> received) override;
  void gather(std::span<const std::byte> own, std::span<std::byte> all) override;

 private:
  nb::handle object_;
  std::uint32_t rank_, size_;
  std::atomic<bool>* in_use_;
};

}  // namespace python
}  // namespace JFPX_ABI
}  // namespace jfpx
