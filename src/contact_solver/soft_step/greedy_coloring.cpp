/// Greedy coloring in the order of hashes; see the header.
#include "src/contact_solver/soft_step/greedy_coloring.hpp"

#include "src/base/parallel_for.hpp"
#include "src/base/reserve.hpp"

#include <algorithm>
#include <numeric>
#include <tuple>

namespace jfpx {
inline namespace JFPX_ABI {
namespace soft_step {

namespace {

/// Orders are divided by their highest bits. Hashes are uniform, so the buckets have similar sizes.
constexpr unsigned kBucketBits = 6, kBuckets = 1u << kBucketBits;
constexpr std::size_t kBodiesPerChunk = 16384;
/// Below this number of contacts, sorting takes less time than a parallel loop.
constexpr std::size_t kFewContacts = 256;
constexpr std::uint32_t kNone = 0xffffffffu;

std::size_t bucket_of(std::uint64_t order) { return order >> (64 - kBucketBits); }

}  // namespace

void GreedyColoring::start(std::size_t bodies, ThreadPool* pool, const Domain* domain) {
  resize_geometric(&used_, bodies);
  uncolored_.clear();
  if (domain != nullptr) {
    for (const std::uint32_t body : domain->present()) used_[body] = {};
    return;
  }
  parallel_for(pool, bodies, kBodiesPerChunk, [this](std::size_t first, std::size_t last) {
    std::ranges::fill(std::span(used_).subspan(first, last - first), UsedColors{});
  });
}

void GreedyColoring::append(std::span<const Uncolored> contacts) {
  if (contacts.empty()) return;
  const std::lock_guard lock(mutex_);
  uncolored_.insert(uncolored_.end(), contacts.begin(), contacts.end());
}

/// Fills sorted_: a counting sort into buckets, which are sorted in parallel.
void GreedyColoring::sort(ThreadPool* pool) {
  resize_geometric(&sorted_, uncolored_.size());
  std::array<std::size_t, kBuckets + 1> begin{};
  for (const Uncolored& contact : uncolored_) ++begin[bucket_of(contact.order) + 1];
  std::partial_sum(begin.begin(), begin.end(), begin.begin());
  auto next = begin;
  for (const Uncolored& contact : uncolored_) sorted_[next[bucket_of(contact.order)]++] = contact;
  const auto order = [](const Uncolored& x, const Uncolored& y) {
    return std::tie(x.order, x.contact) < std::tie(y.order, y.contact);
  };
  ThreadPool* const sorters = uncolored_.size() > kFewContacts ? pool : nullptr;
  parallel_for(sorters, kBuckets, 1, [&](std::size_t first, std::size_t last) {
    for (std::size_t bucket = first; bucket < last; ++bucket) {
      std::ranges::sort(
          std::span(sorted_).subspan(begin[bucket], begin[bucket + 1] - begin[bucket]), order);
    }
  });
}

/// Colors the waiting contacts for which no earlier contact of the bodies waits, and sends the
/// colors at bodies of this rank whose next contact is with a body of another rank.
void GreedyColoring::color_ready(const Domain& domain, std::span<Communicator::Message> messages) {
  ++round_;
  std::size_t left = 0;
  for (const std::uint32_t i : waiting_) {
    const Uncolored& contact = sorted_[i];
    const auto waits = [&] {
      blocked_[contact.a] = blocked_[contact.b] = round_;
      waiting_[left++] = i;
    };
    if (crossing_[i] == kNone) {
      if (blocked_[contact.a] == round_ || blocked_[contact.b] == round_) {
        waits();
      } else {
        colors_[i] = take_lowest_color(contact.is_inner, &used_[contact.a], &used_[contact.b]);
      }
      continue;
    }
    const std::uint32_t mine = domain.is_mine(contact.a) ? contact.a : contact.b;
    if (blocked_[mine] == round_) {
      waits();
      continue;
    }
    Crossing& crossing = crossings_[crossing_[i]];
    if (!crossing.is_sent) {
      const SentColors sent{crossing.place, used_[mine].of_class(contact.is_inner)};
      append_items(&messages[crossing.rank], std::span(&sent, 1));
      crossing.is_sent = true;
    }
    if (!crossing.is_received) {
      waits();
      continue;
    }
    UsedColors of_other;
    of_other.of_class(contact.is_inner) = crossing.used;
    colors_[i] = take_lowest_color(contact.is_inner, &used_[mine], &of_other);
  }
  waiting_.resize(left);
}

/// Fills colors_. The contacts of two ranks have the same order on both.
void GreedyColoring::color_with_other_ranks(Domain* domain) {
  const std::size_t count = sorted_.size();
  resize_geometric(&colors_, count);
  assign_geometric(&crossing_, count, kNone);
  blocked_.resize(used_.size());
  crossings_.clear();
  crossings_of_rank_.resize(domain->ranks());
  for (auto& list : crossings_of_rank_) list.clear();
  resize_geometric(&waiting_, count);
  std::iota(waiting_.begin(), waiting_.end(), 0u);
  for (std::size_t i = 0; i < count; ++i) {
    const Uncolored& contact = sorted_[i];
    if (!domain->crosses(contact.a, contact.b)) continue;
    const Domain::Rank rank = domain->other_rank(contact.a, contact.b);
    std::vector<std::uint32_t>& list = crossings_of_rank_[rank];
    crossing_[i] = static_cast<std::uint32_t>(crossings_.size());
    crossings_.push_back({0, static_cast<std::uint32_t>(list.size()), rank});
    list.push_back(crossing_[i]);
  }
  for (;;) {
    color_ready(*domain, domain->start_messages());
    if (!domain->any(!waiting_.empty())) return;
    const std::span<const Communicator::Message> received = domain->send();
    for (std::size_t r = 0; r < received.size(); ++r) {
      for (MessageReader reader(received[r]); !reader.at_end();) {
        const auto sent = reader.get<SentColors>();
        Crossing& crossing = crossings_[crossings_of_rank_[r][sent.place]];
        crossing.used = sent.used;
        crossing.is_received = true;
      }
    }
  }
}

}  // namespace soft_step
}  // namespace JFPX_ABI
}  // namespace jfpx
