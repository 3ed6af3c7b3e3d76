/// Messages by MPI.
#include <jfpx/mpi.hpp>

#include "src/mpi/check.hpp"

#include <algorithm>
#include <string>

namespace jfpx {
inline namespace JFPX_ABI {
namespace mpi {
namespace {

/// [bytes] MPI counts by int, so larger messages are sent in parts. Parts of this size need no more
/// time than a whole message. MPI delivers messages of two ranks with the same tag in their order.
constexpr std::size_t kLargestPart = std::size_t{1} << 26;
constexpr int kTag = 0;

/// Calls f(offset, size) for each part of a message.
template <class F>
void for_each_part(std::size_t bytes, const F& f) {
  for (std::size_t offset = 0; offset < bytes; offset += kLargestPart) {
    f(offset, static_cast<int>(std::min(kLargestPart, bytes - offset)));
  }
}

}  // namespace

Communicator::Communicator(MPI_Comm communicator) {
  check(MPI_Comm_dup(communicator, &communicator_), "MPI_Comm_dup");
  int rank = 0, size = 1;
  check(MPI_Comm_set_errhandler(communicator_, MPI_ERRORS_RETURN), "MPI_Comm_set_errhandler");
  check(MPI_Comm_rank(communicator_, &rank), "MPI_Comm_rank");
  check(MPI_Comm_size(communicator_, &size), "MPI_Comm_size");
  rank_ = static_cast<std::uint32_t>(rank);
  size_ = static_cast<std::uint32_t>(size);
  sizes_.resize(size_);
  received_sizes_.resize(size_);
}

Communicator::~Communicator() {
  int finalized = 0;
  if (MPI_Finalized(&finalized) == MPI_SUCCESS && finalized == 0) MPI_Comm_free(&communicator_);
}

void Communicator::exchange(std::span<const Message> sent, std::span<Message> received) {
  check_counts(sent.size(), received.size());
  for (std::uint32_t r = 0; r < size_; ++r) sizes_[r] = r == rank_ ? 0 : sent[r].size();
  check(MPI_Alltoall(sizes_.data(), 1, MPI_UINT64_T, received_sizes_.data(), 1, MPI_UINT64_T,
                     communicator_),
        "MPI_Alltoall");
  for (std::uint32_t r = 0; r < size_; ++r) {
    if (r != rank_) received[r].resize(received_sizes_[r]);
  }
  transfer(sent, received);
}

void Communicator::exchange_sized(std::span<const std::span<const std::byte>> sent,
                                  std::span<const std::span<std::byte>> received) {
  check_counts(sent.size(), received.size());
  transfer(sent, received);
}

void Communicator::gather(std::span<const std::byte> own, std::span<std::byte> all) {
  if (all.size() != own.size() * size_) {
    throw InvalidArgument("gather(): all has " + std::to_string(all.size()) +
                          " bytes; it must have " + std::to_string(own.size() * size_) + ", " +
                          std::to_string(own.size()) + " of each rank");
  }
  if (own.size() <= kLargestPart) {
    const int bytes = static_cast<int>(own.size());
    check(MPI_Allgather(own.data(), bytes, MPI_BYTE, all.data(), bytes, MPI_BYTE, communicator_),
          "MPI_Allgather");
    return;
  }
  for (std::uint32_t r = 0; r < size_; ++r) {
    if (r != rank_) start_receive(all.subspan(r * own.size(), own.size()), r);
  }
  for (std::uint32_t r = 0; r < size_; ++r) {
    if (r != rank_) start_send(own, r);
  }
  std::ranges::copy(own, all.begin() + static_cast<std::ptrdiff_t>(rank_ * own.size()));
  wait();
}

void Communicator::check_counts(std::size_t sent, std::size_t received) const {
  if (sent == size_ && received == size_) return;
  throw InvalidArgument("exchange: there are " + std::to_string(sent) + " messages to send and " +
                        std::to_string(received) + " to receive; both must be " +
                        std::to_string(size_) + ", the number of ranks");
}

template <class Sent, class Received>
void Communicator::transfer(const Sent& sent, const Received& received) {
  for (std::uint32_t r = 0; r < size_; ++r) {
    if (r != rank_) start_receive(received[r], r);
  }
  for (std::uint32_t r = 0; r < size_; ++r) {
    if (r != rank_) start_send(sent[r], r);
  }
  wait();
}

void Communicator::start_receive(std::span<std::byte> bytes, std::uint32_t from) {
  for_each_part(bytes.size(), [&](std::size_t offset, int size) {
    check(MPI_Irecv(bytes.data() + offset, size, MPI_BYTE, static_cast<int>(from), kTag,
                    communicator_, &requests_.emplace_back(MPI_REQUEST_NULL)),
          "MPI_Irecv");
  });
}

void Communicator::start_send(std::span<const std::byte> bytes, std::uint32_t to) {
  for_each_part(bytes.size(), [&](std::size_t offset, int size) {
    check(MPI_Isend(bytes.data() + offset, size, MPI_BYTE, static_cast<int>(to), kTag,
                    communicator_, &requests_.emplace_back(MPI_REQUEST_NULL)),
          "MPI_Isend");
  });
}

void Communicator::wait() {
  // MPI_Waitall() of Open MPI 4.1 may not return if a request fails.
  int code = MPI_SUCCESS;
  for (std::size_t i = 0; i < requests_.size() && code == MPI_SUCCESS; ++i) {
    code = MPI_Wait(&requests_[i], MPI_STATUS_IGNORE);
  }
  requests_.clear();
  check(code, "MPI_Wait");
}

}  // namespace mpi
}  // namespace JFPX_ABI
}  // namespace jfpx
