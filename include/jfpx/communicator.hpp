/// Communication between the processes that share a world.
#pragma once

#include <jfpx/config.hpp>

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {

/// Group of ranks that hold one world together: each rank is a process, or a thread, with a World
/// of its own. jfpx::mpi::Communicator (jfpx/mpi.hpp) uses MPI; other classes may use any
/// transport. The functions below are collective: all ranks call the same ones in the same order,
/// from one thread each, and a call returns when its data has arrived. An exception of a function
/// leaves the ranks in different states, so the program should then end on all ranks.
class Communicator {
 public:
  using Message = std::vector<std::byte>;

  virtual ~Communicator() = default;
  /// Number of this rank, below size().
  virtual std::uint32_t rank() const noexcept = 0;
  /// Number of ranks, at least 1.
  virtual std::uint32_t size() const noexcept = 0;
  /// Sends sent[r] to each rank r, and receives one message from each rank. The entries of this
  /// rank are not used.
  /// @param sent     one message for each rank; may be empty messages
  /// @param received one for each rank; their contents and sizes are replaced
  virtual void exchange(std::span<const Message> sent, std::span<Message> received) = 0;
  /// exchange() with messages whose sizes the receivers know. No message is sent for a size of 0.
  /// @param sent     one message for each rank
  /// @param received one for each rank, as long as the message of that rank; receives its bytes
  virtual void exchange_sized(std::span<const std::span<const std::byte>> sent,
                              std::span<const std::span<std::byte>> received) = 0;
  /// Sends the same bytes to all ranks.
  /// @param own equally many bytes on all ranks
  /// @param all size() times as many; receives those of all ranks, in their order
  virtual void gather(std::span<const std::byte> own, std::span<std::byte> all) = 0;
};

}  // namespace JFPX_ABI
}  // namespace jfpx
