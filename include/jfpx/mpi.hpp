/// MPI between the processes that share a world. Library jfpx::mpi.
#pragma once

#include <jfpx/communicator.hpp>

#include <cstddef>
#include <cstdint>
#include <mpi.h>
#include <span>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace mpi {

/// MPI_Init_thread() with MPI_THREAD_FUNNELED, and MPI_Finalize() at the end of the lifetime. Does
/// nothing if MPI is already initialized. Belongs to the main thread; communicators are destroyed
/// first.
class JFPX_MPI_API Session {
 public:
  /// @throws Error if MPI can't be initialized, or has been finalized
  Session();
  /// After an exception, does not finalize MPI, which would wait for all other ranks: the program
  /// should end with an error, and the launcher then ends the other ranks.
  ~Session();
  Session(const Session&) = delete;
  Session& operator=(const Session&) = delete;

 private:
  bool owns_ = false;
  int exceptions_ = 0;  ///< number of exceptions in flight at the start
};

/// The ranks of an MPI communicator. All functions are called by the thread that has initialized
/// MPI, unless that has been done with MPI_THREAD_SERIALIZED or more. Messages have any size. Each
/// function throws Error, with the text of MPI, if a call of MPI fails, and InvalidArgument for
/// spans of other sizes than jfpx::Communicator requires.
class JFPX_MPI_API Communicator final : public jfpx::Communicator {
 public:
  /// Duplicates a communicator, so that other messages of the program are separate. Collective.
  explicit Communicator(MPI_Comm communicator = MPI_COMM_WORLD);
  /// Collective, unless MPI is already finalized.
  ~Communicator() override;
  Communicator(const Communicator&) = delete;
  Communicator& operator=(const Communicator&) = delete;

  std::uint32_t rank() const noexcept override { return rank_; }
  std::uint32_t size() const noexcept override { return size_; }
  void exchange(std::span<const Message> sent, std::span<Message> received) override;
  void exchange_sized(std::span<const std::span<const std::byte>> sent,
                      std::span<const std::span<std::byte>> received) override;
  void gather(std::span<const std::byte> own, std::span<std::byte> all) override;

 private:
  void check_counts(std::size_t sent, std::size_t received) const;
  template <class Sent, class Received>
  void transfer(const Sent& sent, const Received& received);
  void start_receive(std::span<std::byte> bytes, std::uint32_t from);
  void start_send(std::span<const std::byte> bytes, std::uint32_t to);
  void wait();

  MPI_Comm communicator_ = MPI_COMM_NULL;
  std::uint32_t rank_ = 0, size_ = 1;
  std::vector<std::uint64_t> sizes_, received_sizes_;  ///< [bytes] of messages, by rank
  std::vector<MPI_Request> requests_;                  ///< those that wait() completes
};

}  // namespace mpi
}  // namespace JFPX_ABI
}  // namespace jfpx
