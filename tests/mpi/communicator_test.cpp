/// Exchanges messages of known contents among the ranks that mpirun has started.
/// Usage: communicator_test, or communicator_test RANK: this rank throws while the others wait.
#include <jfpx/error.hpp>
#include <jfpx/mpi.hpp>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <stdexcept>
#include <string>
#include <vector>

namespace jfpx {
namespace {

using Messages = std::vector<Communicator::Message>;

void require(bool condition, const std::string& what) {
  if (!condition) throw std::runtime_error(what);
}

std::byte byte_of(std::uint32_t from, std::uint32_t to, std::size_t index) {
  return static_cast<std::byte>(from * 31 + to * 17 + index * 7 + index / 251);
}

Communicator::Message message(std::uint32_t from, std::uint32_t to, std::size_t size) {
  Communicator::Message bytes(size);
  constexpr std::size_t kPeriod = 1021;
  for (std::size_t i = 0; i < std::min(size, kPeriod); ++i) bytes[i] = byte_of(from, to, i);
  for (std::size_t i = kPeriod; i < size; i += kPeriod) {
    std::copy_n(bytes.begin(), std::min(size - i, kPeriod), &bytes[i]);
  }
  return bytes;
}

/// exchange_sized() of messages.
void exchange_sized(Communicator& ranks, const Messages& sent, Messages* received) {
  const std::vector<std::span<const std::byte>> from(sent.begin(), sent.end());
  const std::vector<std::span<std::byte>> to(received->begin(), received->end());
  ranks.exchange_sized(from, to);
}

/// Exchanges messages of size_of(from, to) bytes, by both functions.
template <class SizeOf>
void test_exchange(Communicator& ranks, const SizeOf& size_of) {
  const std::uint32_t own = ranks.rank();
  const Communicator::Message untouched(3, std::byte{99});
  Messages sent(ranks.size()), received(ranks.size()), sized(ranks.size());
  for (std::uint32_t r = 0; r < ranks.size(); ++r) {
    sent[r] = message(own, r, size_of(own, r));
    received[r].resize(5);  // replaced
    sized[r].resize(size_of(r, own));
  }
  received[own] = sized[own] = untouched;
  ranks.exchange(sent, received);
  exchange_sized(ranks, sent, &sized);
  for (std::uint32_t r = 0; r < ranks.size(); ++r) {
    const auto expected = r == own ? untouched : message(r, own, size_of(r, own));
    require(received[r] == expected, "exchange() from rank " + std::to_string(r));
    require(sized[r] == expected, "exchange_sized() from rank " + std::to_string(r));
  }
}

void test_gather(Communicator& ranks, std::size_t size) {
  Communicator::Message all(size * ranks.size());
  ranks.gather(message(ranks.rank(), 0, size), all);
  for (std::uint32_t r = 0; r < ranks.size(); ++r) {
    require(std::ranges::equal(std::span(all).subspan(r * size, size), message(r, 0, size)),
            "gather() of " + std::to_string(size) + " bytes from rank " + std::to_string(r));
  }
}

template <class Exception, class F>
std::string message_of(const F& call) {
  try {
    call();
  } catch (const Exception& error) {
    return error.what();
  }
  return {};
}

void test_wrong_sizes(Communicator& ranks) {
  Messages right(ranks.size()), wrong(ranks.size() + 1);
  std::vector<std::byte> byte(1), bytes(ranks.size() + 1);
  require(message_of<InvalidArgument>([&] { ranks.exchange(wrong, right); }) != "", "sent");
  require(message_of<InvalidArgument>([&] { exchange_sized(ranks, right, &wrong); }) != "",
          "received");
  require(message_of<InvalidArgument>([&] { ranks.gather(byte, bytes); }) != "", "gathered");
  if (ranks.size() == 1) return;
  // Rank 0 sends more to rank 1 than that expects, which MPI reports there.
  Messages sent(ranks.size()), received(ranks.size());
  if (ranks.rank() == 0) sent[1].resize(8);
  if (ranks.rank() == 1) received[0].resize(4);
  const std::string text = message_of<Error>([&] { exchange_sized(ranks, sent, &received); });
  require((text.find("truncated") != std::string::npos) == (ranks.rank() == 1),
          "error of MPI: " + text);
}

void test(Communicator& ranks) {
  test_exchange(ranks, [](auto, auto) { return 0u; });
  test_exchange(ranks, [](auto from, auto to) { return from == 0 ? to * 1000 : 0; });
  for (std::uint32_t round = 0; round < 20; ++round) {
    test_exchange(ranks, [round](auto from, auto to) {
      const std::uint32_t mixed = (from * 7 + to * 5 + round * 3) % 11;
      return mixed % 3 == 0 ? 0 : mixed * 100 + round;
    });
  }
  const std::uint32_t size = ranks.size();
  constexpr std::size_t kMegabyte = 1 << 20;
  test_exchange(ranks, [size](auto from, auto to) {
    return (from + 1) % size == to ? 3 * kMegabyte + from : 0;
  });
  for (const std::size_t bytes : {std::size_t{0}, std::size_t{1}, std::size_t{24}, kMegabyte}) {
    test_gather(ranks, bytes);
  }
  if (size == 2) {  // messages in parts
    test_exchange(ranks, [](auto from, auto) { return from == 0 ? 64 * kMegabyte + 5 : 1u; });
    test_gather(ranks, 64 * kMegabyte + 5);
  }
  test_wrong_sizes(ranks);
}

int run(int argc, char** argv) {
  const mpi::Session session, inner;
  mpi::Communicator ranks;
  if (argc > 1) {
    if (ranks.rank() == std::strtoul(argv[1], nullptr, 10)) throw Error("this rank fails");
    Messages sent(ranks.size()), received(ranks.size());
    ranks.exchange(sent, received);
    return 0;
  }
  try {
    test(ranks);
    mpi::Communicator other(MPI_COMM_SELF);
    test(other);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "rank %u: %s\n", ranks.rank(), error.what());
    MPI_Abort(MPI_COMM_WORLD, 1);
  }
  if (ranks.rank() == 0) std::printf("%u ranks have exchanged messages\n", ranks.size());
  return 0;
}

}  // namespace
}  // namespace jfpx

int main(int argc, char** argv) {
  try {
    return jfpx::run(argc, argv);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
}
