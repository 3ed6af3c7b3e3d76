/// Count, scan and emit: every pair is written once, at a position that does not depend on the
/// thread.
#include "src/sphere_collider/cpu/contact_writer.hpp"

#include "src/collide/sphere_pair.hpp"

#include <algorithm>
#include <bit>
#include <limits>
#include <numeric>

namespace jfpx {
inline namespace JFPX_ABI {
namespace cpu {
namespace {

std::uint32_t lower(std::uint64_t pair) { return static_cast<std::uint32_t>(pair >> 32); }
std::uint32_t higher(std::uint64_t pair) { return static_cast<std::uint32_t>(pair); }
SpherePair unpacked(std::uint64_t pair) { return {lower(pair), higher(pair)}; }

constexpr std::size_t kBlock = 1024;     ///< rows per part of the result
constexpr std::size_t kRowsAhead = 8;    ///< prefetch distance: rows are read in random order
constexpr std::size_t kPairsAhead = 16;  ///< prefetch distance: so are spheres

/// By the higher sphere, which is different in all pairs of a row.
bool less_in_row(const SpherePair& p, const SpherePair& q) { return p.b < q.b; }

/// LSD radix sort, for rows that are too long for a comparison sort.
void sort_long_row(SpherePair* row, SpherePair* spare, std::size_t count) {
  constexpr unsigned kBits = 11;
  SpherePair* const home = row;
  const auto bits =
      static_cast<unsigned>(std::bit_width(std::max_element(row, row + count, less_in_row)->b));
  for (unsigned shift = 0; shift < bits; shift += kBits) {
    std::size_t next[1u << kBits] = {};
    const auto digit = [&](const SpherePair& p) { return (p.b >> shift) & ((1u << kBits) - 1); };
    for (std::size_t i = 0; i < count; ++i) ++next[digit(row[i])];
    std::exclusive_scan(std::begin(next), std::end(next), std::begin(next), std::size_t{0});
    for (std::size_t i = 0; i < count; ++i) spare[next[digit(row[i])]++] = row[i];
    std::swap(row, spare);
  }
  if (row != home) std::copy_n(row, count, home);
}

/// Writes a row of at most `Capacity` pairs sorted: counts, for each, the lower ones. The order of
/// a row is random, so branches on comparisons would be unpredictable; these loops have none, and
/// compilers vectorize them.
template <std::size_t Capacity>
void sort_by_rank(const std::uint64_t* row, std::size_t count, SpherePair* sorted) {
  // Signed, because baseline instructions have no unsigned comparison.
  std::int32_t keys[Capacity];
  std::int32_t ranks[Capacity] = {};
  for (std::size_t i = 0; i < count; ++i) {
    keys[i] = static_cast<std::int32_t>(higher(row[i]) ^ 0x80000000u);
  }
  std::fill(keys + count, keys + Capacity, std::numeric_limits<std::int32_t>::max());
  for (std::size_t i = 0; i < count; ++i) {
    const std::int32_t key = keys[i];
    for (std::size_t k = 0; k < Capacity; ++k) ranks[k] += key < keys[k] ? 1 : 0;
  }
  for (std::size_t i = 0; i < count; ++i) sorted[ranks[i]] = unpacked(row[i]);
}

/// Writes a row sorted.
void sort_row(const std::uint64_t* row, std::size_t count, SpherePair* sorted, SpherePair* spare) {
  if (count <= 1) {
    if (count == 1) *sorted = unpacked(*row);
    return;
  }
  if (count <= 4) return sort_by_rank<4>(row, count, sorted);
  if (count <= 8) return sort_by_rank<8>(row, count, sorted);
  if (count <= 16) return sort_by_rank<16>(row, count, sorted);
  if (count <= 32) return sort_by_rank<32>(row, count, sorted);
  if (count <= 64) return sort_by_rank<64>(row, count, sorted);
  std::transform(row, row + count, sorted, unpacked);
  if (count > 512) return sort_long_row(sorted, spare, count);
  std::sort(sorted, sorted + count, less_in_row);
}

}  // namespace

/// Writes make(pair) for pairs that are sorted across all chunks.
template <class Item, class Make>
std::span<const Item> ContactWriter::write_chunks(const PairChunks& chunks, ThreadPool& pool,
                                                  Buffer<Item>* items, const Make& make) {
  sections_.reserve(chunks.size(), "parts of pairs");
  std::uint64_t total = 0;
  for (std::size_t i = 0; i < chunks.size(); ++i) {
    sections_[i] = total;
    total += chunks[i].size();
  }
  items->reserve(total, "contacts");
  pool.run(chunks.size(), [&](std::size_t i) {
    std::transform(chunks[i].begin(), chunks[i].end(), items->data() + sections_[i], make);
  });
  return {items->data(), total};
}

ContactSpan ContactWriter::write_contacts(std::span<const SphereInstance> spheres,
                                          const PairChunks& chunks, PairOrder order,
                                          ThreadPool& pool) {
  const auto contact_of = [&](const SpherePair& p) {
    const PairResult r = detail::test_sphere_pair(spheres[p.a], spheres[p.b]);
    return SphereContact{p.a, p.b, r.normal, r.distance};
  };
  if (order == PairOrder::sorted) {
    return write_chunks(chunks, pool, &contacts_,
                        [&](std::uint64_t pair) { return contact_of(unpacked(pair)); });
  }
  const std::span<const SpherePair> pairs = write_pairs(spheres.size(), chunks, order, pool);
  contacts_.reserve(pairs.size(), "contacts");
  constexpr std::size_t kPart = 8192;
  pool.run((pairs.size() + kPart - 1) / kPart, [&](std::size_t part) {
    const std::size_t end = std::min(pairs.size(), (part + 1) * kPart);
    for (std::size_t i = part * kPart; i < end; ++i) {
      if (i + kPairsAhead < end) __builtin_prefetch(&spheres[pairs[i + kPairsAhead].b]);
      contacts_[i] = contact_of(pairs[i]);
    }
  });
  return {contacts_.data(), pairs.size()};
}

std::span<const SpherePair> ContactWriter::write_pairs(std::size_t spheres,
                                                       const PairChunks& chunks, PairOrder order,
                                                       ThreadPool& pool) {
  if (order == PairOrder::sorted) return write_chunks(chunks, pool, &pairs_, unpacked);
  if (order == PairOrder::none) make_rows(chunks, spheres, pool);
  if (order == PairOrder::by_lower_sphere) index_rows(chunks, spheres, pool);
  return write_rows(spheres, pool);
}

/// Writes the pairs of rows_.
std::span<const SpherePair> ContactWriter::write_rows(std::size_t spheres, ThreadPool& pool) {
  const std::size_t blocks = (spheres + kBlock - 1) / kBlock;
  const auto rows = [&](std::size_t block) {
    return std::span<const Row>(rows_.data(), spheres)
        .subspan(block * kBlock, std::min(kBlock, spheres - block * kBlock));
  };
  sections_.reserve(blocks, "parts of pairs");
  pool.run(blocks, [&](std::size_t block) {
    std::uint64_t count = 0;
    for (const Row& row : rows(block)) count += row.count;
    sections_[block] = count;
  });
  std::uint64_t total = 0;
  for (std::size_t block = 0; block < blocks; ++block) {
    total += std::exchange(sections_[block], total);
  }
  pairs_.reserve(total, "pairs");
  spare_.reserve(total, "pairs");
  pool.run(blocks, [&](std::size_t block) {
    std::uint64_t at = sections_[block];
    const std::span<const Row> own = rows(block);
    for (std::size_t i = 0; i < own.size(); ++i) {
      prefetch(own[std::min(i + kRowsAhead, own.size() - 1)]);
      sort_row(own[i].pairs, own[i].count, pairs_.data() + at, spare_.data() + at);
      at += own[i].count;
    }
  });
  return {pairs_.data(), total};
}

void ContactWriter::prefetch(const Row& row) {
  constexpr std::uint64_t kLine = 64 / sizeof *row.pairs;
  __builtin_prefetch(row.pairs);
  for (std::uint64_t i = kLine; i < std::min(row.count, 4 * kLine); i += kLine) {
    __builtin_prefetch(row.pairs + i);
  }
}

/// Fills rows_ from chunks in which the pairs of a lower sphere are consecutive.
void ContactWriter::index_rows(const PairChunks& chunks, std::size_t spheres, ThreadPool& pool) {
  rows_.reserve(spheres, "rows of pairs");
  std::fill_n(rows_.data(), spheres, Row{});
  pool.run(chunks.size(), [&](std::size_t chunk) {
    const std::span<const std::uint64_t> all = chunks[chunk];
    for (std::size_t i = 0; i < all.size();) {
      const std::size_t begin = i;
      const std::uint32_t a = lower(all[begin]);
      while (i < all.size() && lower(all[i]) == a) ++i;
      rows_[a] = {&all[begin], i - begin};
    }
  });
}

/// Fills rows_ from chunks in any order. Pairs are first divided into buckets of neighbouring lower
/// spheres, so that the rest stays in the cache of one core.
void ContactWriter::make_rows(const PairChunks& chunks, std::size_t spheres, ThreadPool& pool) {
  const auto bits = static_cast<unsigned>(std::bit_width(spheres));
  // At most 256 buckets: streams that fit in the TLB.
  const unsigned bucket_bits = bits > 18 ? bits - 8 : 10;
  const std::size_t buckets = (spheres >> bucket_bits) + 1;
  divide(chunks, bucket_bits, buckets, pool);
  rows_.reserve(spheres, "rows of pairs");
  grouped_.reserve(sections_[buckets], "pairs in rows");
  pool.run(buckets, [&](std::size_t bucket) {
    const std::span<const std::uint64_t> own(divided_.data() + sections_[bucket],
                                             divided_.data() + sections_[bucket + 1]);
    const std::size_t first = bucket << bucket_bits;
    const std::size_t last = std::min(spheres, first + (std::size_t{1} << bucket_bits));
    if (first >= last) return;
    std::fill(rows_.data() + first, rows_.data() + last, Row{});
    for (const std::uint64_t p : own) ++rows_[lower(p)].count;
    const std::uint64_t* begin = grouped_.data() + sections_[bucket];
    for (std::size_t a = first; a < last; ++a) {
      rows_[a].pairs = begin;
      begin += std::exchange(rows_[a].count, 0);
    }
    for (const std::uint64_t p : own) {
      Row& row = rows_[lower(p)];
      grouped_[static_cast<std::size_t>(row.pairs - grouped_.data()) + row.count++] = p;
    }
  });
}

void ContactWriter::divide(const PairChunks& chunks, unsigned bucket_bits, std::size_t buckets,
                           ThreadPool& pool) {
  offsets_.reserve(chunks.size() * buckets, "counts of pairs");
  pool.run(chunks.size(), [&](std::size_t chunk) {
    std::uint64_t* counts = offsets_.data() + chunk * buckets;
    std::fill_n(counts, buckets, 0u);
    for (const std::uint64_t p : chunks[chunk]) ++counts[lower(p) >> bucket_bits];
  });
  sections_.reserve(buckets + 1, "buckets of pairs");
  std::uint64_t sum = 0;
  for (std::size_t bucket = 0; bucket < buckets; ++bucket) {
    sections_[bucket] = sum;
    for (std::size_t chunk = 0; chunk < chunks.size(); ++chunk) {
      std::uint64_t& offset = offsets_[chunk * buckets + bucket];
      sum += std::exchange(offset, sum);
    }
  }
  sections_[buckets] = sum;
  divided_.reserve(sum, "pairs in buckets");
  pool.run(chunks.size(), [&](std::size_t chunk) {
    std::uint64_t* next = offsets_.data() + chunk * buckets;
    for (const std::uint64_t p : chunks[chunk]) divided_[next[lower(p) >> bucket_bits]++] = p;
  });
}

}  // namespace cpu
}  // namespace JFPX_ABI
}  // namespace jfpx
