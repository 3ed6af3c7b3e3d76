/// Interrupted searches, wherever they end.
#include "src/base/interrupt.hpp"

#include <jfpx/contact_list.hpp>
#include <jfpx/periodic.hpp>

#include "tests/support/sphere_fixtures.hpp"

#include <gtest/gtest.h>

#include <atomic>
#include <functional>
#include <span>
#include <thread>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace test {
namespace {

struct Stop {};

int polls_left = 0;
void stop_at_last_poll() {
  if (polls_left-- == 0) throw Stop();
}

using Bytes = std::vector<std::byte>;

template <class Range>
Bytes to_bytes(const Range& items) {
  const auto bytes = std::as_bytes(std::span(items.data(), items.size()));
  return {bytes.begin(), bytes.end()};
}
/// Without the padding of the items.
Bytes to_bytes(const std::vector<PeriodicContact>& contacts) {
  Bytes all;
  for (const PeriodicContact& c : contacts) {
    for (const Bytes& part : {to_bytes(std::span(&c.contact, 1)), to_bytes(c.shift)}) {
      all.insert(all.end(), part.begin(), part.end());
    }
  }
  return all;
}

/// Ends `search` at its first poll, then at later and later ones, until it ends by itself. Of
/// several threads, only the calling one polls, and the others may leave it no work.
void interrupt_everywhere(const char* name, unsigned threads,
                          const std::function<Bytes()>& search) {
  SCOPED_TRACE(name);
  const Bytes expected = search();
  ASSERT_FALSE(expected.empty());
  for (int polls = 0;; polls += 1 + polls / 2) {
    const Interrupt interrupt(stop_at_last_poll, Interrupt::Clock::duration::zero());
    polls_left = polls;
    try {
      EXPECT_EQ(search(), expected);
      if (threads == 1) {
        EXPECT_GT(polls, 1);
      }
      return;
    } catch (const Stop&) {
      polls_left = -1;  // the next search is not interrupted
      ASSERT_EQ(search(), expected) << "after " << polls << " polls";
    }
  }
}

TEST(Interrupt, ASearchEndsAtAnyPollAndTheNextOneIsComplete) {
  Random random(base_seed());
  SCOPED_TRACE(seed_note());
  const auto spheres = make_gas(3000, Real(0.5), 20, random);
  const auto some = std::span(spheres).first(1000);
  const auto others = std::span(spheres).subspan(1000);
  const PeriodicCell cell{.lengths = {12, 12, 12}, .repeats = {true, true, true}};
  const std::vector<std::uint64_t> offsets{0, 1000, 1700, 3000};
  for (const SphereAlgorithm algorithm : {SphereAlgorithm::grid, SphereAlgorithm::all_pairs}) {
    for (const unsigned threads : {1u, 3u}) {
      const auto collider = make_sphere_collider(
          {.backend = Backend::cpu, .algorithm = algorithm, .threads = threads});
      interrupt_everywhere("pairs", threads,
                           [&] { return to_bytes(collider->find_pairs(spheres)); });
      interrupt_everywhere("contacts", threads,
                           [&] { return to_bytes(collider->find_contacts(spheres)); });
      interrupt_everywhere("between", threads, [&] {
        return to_bytes(find_contacts_between(*collider, some, others));
      });
      interrupt_everywhere("systems", threads, [&] {
        return to_bytes(find_contacts_in_systems(*collider, spheres, offsets));
      });
      interrupt_everywhere("periodic", threads, [&] {
        return to_bytes(find_periodic_contacts(*collider, spheres, cell));
      });
      interrupt_everywhere("both orders", threads, [&] {
        return to_bytes(in_both_orders(collider->find_pairs(spheres), spheres.size()));
      });
    }
  }
}

TEST(Interrupt, OtherThreadsSkipTheRemainingChunks) {
  static std::atomic<bool> has_thrown;
  has_thrown = false;
  const Interrupt interrupt(
      [] {
        has_thrown = true;
        throw Stop();
      },
      Interrupt::Clock::duration::zero());
  ThreadPool pool(3);
  constexpr std::size_t kChunks = 1'000'000;
  std::atomic<std::size_t> run = 0;
  EXPECT_THROW(run_interruptible(pool, kChunks,
                                 [&](std::size_t) {
                                   while (!has_thrown) std::this_thread::yield();
                                   ++run;
                                 }),
               Stop);
  EXPECT_LT(run, kChunks / 2);
}

TEST(Interrupt, EndsNoSearchOfAnotherThread) {
  const Interrupt interrupt([] { throw Stop(); }, Interrupt::Clock::duration::zero());
  Random random(base_seed());
  SCOPED_TRACE(seed_note());
  const auto spheres = make_gas(2000, Real(0.5), 6, random);
  EXPECT_THROW(make_sphere_collider()->find_contacts(spheres), Stop);
  std::thread([&] {
    EXPECT_TRUE(same_bits(make_sphere_collider()->find_contacts(spheres), brute_force(spheres)));
  }).join();
}

}  // namespace
}  // namespace test
}  // namespace JFPX_ABI
}  // namespace jfpx
