/// Count, scan and emit: every pair is written once, at a position that does not depend on the
/// thread.
#include "src/sphere_collider/cpu/contact_writer.hpp"

#include "src/collide/sphere_pair.hpp"
#include "src/sphere_collider/cpu/pair_filter.hpp"

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

constexpr unsigned kPartBits = 10;       ///< bits of the rows per part of the result, at least
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

/// The same for `Count` pairs in registers.
template <std::size_t Count>
void sort_few(const std::uint64_t* row, SpherePair* sorted) {
  std::size_t ranks[Count] = {};
#pragma GCC unroll 4
  for (std::size_t i = 1; i < Count; ++i) {
#pragma GCC unroll 4
    for (std::size_t k = 0; k < i; ++k) {
      const std::size_t above = row[i] > row[k] ? 1 : 0;
      ranks[i] += above;
      ranks[k] += 1 - above;
    }
  }
#pragma GCC unroll 4
  for (std::size_t i = 0; i < Count; ++i) sorted[ranks[i]] = unpacked(row[i]);
}

/// Writes a row sorted.
void sort_row(const std::uint64_t* row, std::size_t count, SpherePair* sorted,
              Buffer<SpherePair>* spare) {
  if (count <= 1) {
    if (count == 1) *sorted = unpacked(*row);
    return;
  }
  if (count == 2) return sort_few<2>(row, sorted);
  if (count == 3) return sort_few<3>(row, sorted);
  if (count == 4) return sort_few<4>(row, sorted);
  if (count <= 8) return sort_by_rank<8>(row, count, sorted);
  if (count <= 16) return sort_by_rank<16>(row, count, sorted);
  if (count <= 32) return sort_by_rank<32>(row, count, sorted);
  if (count <= 64) return sort_by_rank<64>(row, count, sorted);
  std::transform(row, row + count, sorted, unpacked);
  if (count > 512) return sort_long_row(sorted, spare->reserve(count, "pairs"), count);
  std::sort(sorted, sorted + count, less_in_row);
}

/// The contact of a pair that touches.
SphereContact contact_of(const SphereInstance* spheres, const SpherePair& p) {
  const PairResult r = detail::test_sphere_pair(spheres[p.a], spheres[p.b]);
  return {p.a, p.b, r.normal, r.distance};
}

/// The contacts of kRealLanes pairs that touch.
void write_contact_lanes(const SphereInstance* spheres, const SpherePair* pairs,
                         SphereContact* contacts) {
  const SphereLanes a = gather_spheres(spheres, pairs, &SpherePair::a);
  const SphereLanes b = gather_spheres(spheres, pairs, &SpherePair::b);
  const RealLanes x = a.x - b.x, y = a.y - b.y, z = a.z - b.z;
  const RealLanes len = square_root((x * x + y * y) + z * z);
  if (bits(less_equal(len, set_lanes(kEpsilon))) != 0) [[unlikely]] {
    std::transform(pairs, pairs + kRealLanes, contacts,
                   [&](const SpherePair& p) { return contact_of(spheres, p); });
    return;
  }
  const RealLanes scale = set_lanes(1) / len;
  for (std::size_t k = 0; k < kRealLanes; ++k) {
    contacts[k].a = pairs[k].a;
    contacts[k].b = pairs[k].b;
  }
  scatter_contacts(x * scale, y * scale, z * scale, len - (a.radius + b.radius), contacts);
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

/// Writes pairs in parts of consecutive rows. Calls reserve(total) before the first part, and
/// done(pairs) after each, while it is in the cache.
template <class Reserve, class Done>
std::span<const SpherePair> ContactWriter::write_rows(std::size_t spheres, const PairChunks& chunks,
                                                      PairOrder order, ThreadPool& pool,
                                                      const Reserve& reserve, const Done& done) {
  rows_.reserve(spheres, "rows of pairs");
  const bool grouped = order == PairOrder::by_lower_sphere;
  const unsigned part_bits =
      grouped ? index_rows(chunks, spheres, pool) : divide(chunks, spheres, pool);
  const std::size_t parts = (spheres >> part_bits) + 1;
  const std::uint64_t total = sections_[parts];
  pairs_.reserve(total, "pairs");
  reserve(total);
  if (spares_.size() < parts) spares_.resize(parts);
  pool.run(parts, [&](std::size_t part) {
    const std::size_t first = part << part_bits;
    const std::size_t last = std::min(spheres, first + (std::size_t{1} << part_bits));
    if (first >= last) return;
    if (!grouped) make_rows(part, first, last);
    SpherePair* const begin = pairs_.data() + sections_[part];
    SpherePair* end = begin;
    for (std::size_t a = first; a < last; ++a) {
      prefetch(rows_[std::min(a + kRowsAhead, last - 1)]);
      sort_row(rows_[a].pairs, rows_[a].count, end, &spares_[part]);
      end += rows_[a].count;
    }
    done(std::span<const SpherePair>(begin, end));
  });
  return {pairs_.data(), total};
}

ContactSpan ContactWriter::write_contacts(std::span<const SphereInstance> spheres,
                                          const PairChunks& chunks, PairOrder order,
                                          ThreadPool& pool) {
  if (order == PairOrder::sorted) {
    return write_chunks(chunks, pool, &contacts_, [&](std::uint64_t pair) {
      return contact_of(spheres.data(), unpacked(pair));
    });
  }
  const auto reserve = [&](std::uint64_t total) { contacts_.reserve(total, "contacts"); };
  const std::span<const SpherePair> all = write_rows(
      spheres.size(), chunks, order, pool, reserve, [&](std::span<const SpherePair> pairs) {
        SphereContact* const contacts = contacts_.data() + (pairs.data() - pairs_.data());
        const std::size_t count = pairs.size();
        std::size_t i = 0;
        for (; i + kRealLanes <= count; i += kRealLanes) {
          const std::size_t ahead = i + kPairsAhead;
          for (std::size_t k = ahead; k < std::min(ahead + kRealLanes, count); ++k) {
            __builtin_prefetch(&spheres[pairs[k].b]);
          }
          write_contact_lanes(spheres.data(), &pairs[i], contacts + i);
        }
        for (; i < count; ++i) contacts[i] = contact_of(spheres.data(), pairs[i]);
      });
  return {contacts_.data(), all.size()};
}

std::span<const SpherePair> ContactWriter::write_pairs(std::size_t spheres,
                                                       const PairChunks& chunks, PairOrder order,
                                                       ThreadPool& pool) {
  if (order == PairOrder::sorted) return write_chunks(chunks, pool, &pairs_, unpacked);
  return write_rows(
      spheres, chunks, order, pool, [](std::uint64_t) {}, [](std::span<const SpherePair>) {});
}

void ContactWriter::prefetch(const Row& row) {
  constexpr std::uint64_t kLine = 64 / sizeof *row.pairs;
  __builtin_prefetch(row.pairs);
  for (std::uint64_t i = kLine; i < std::min(row.count, 4 * kLine); i += kLine) {
    __builtin_prefetch(row.pairs + i);
  }
}

/// Fills rows_ from chunks in which the pairs of a lower sphere are consecutive, and sections_ with
/// the begins of parts of rows. Returns the bits of the size of a part.
unsigned ContactWriter::index_rows(const PairChunks& chunks, std::size_t spheres,
                                   ThreadPool& pool) {
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
  const std::size_t parts = (spheres >> kPartBits) + 1;
  sections_.reserve(parts + 1, "parts of pairs");
  pool.run(parts, [&](std::size_t part) {
    const std::size_t first = part << kPartBits;
    const std::size_t last = std::min(spheres, first + (std::size_t{1} << kPartBits));
    std::uint64_t count = 0;
    for (std::size_t a = first; a < last; ++a) count += rows_[a].count;
    sections_[part] = count;
  });
  sections_[parts] = 0;
  std::exclusive_scan(sections_.data(), sections_.data() + parts + 1, sections_.data(),
                      std::uint64_t{0});
  return kPartBits;
}

/// Fills the rows of a bucket of neighbouring lower spheres [first, last).
void ContactWriter::make_rows(std::size_t bucket, std::size_t first, std::size_t last) {
  const std::span<const std::uint64_t> own(divided_.data() + sections_[bucket],
                                           divided_.data() + sections_[bucket + 1]);
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
}

/// Divides pairs into buckets of neighbouring lower spheres, so that the rest stays in the cache of
/// one core. Fills divided_ and sections_. Returns the bits of the size of a bucket.
unsigned ContactWriter::divide(const PairChunks& chunks, std::size_t spheres, ThreadPool& pool) {
  const auto bits = static_cast<unsigned>(std::bit_width(spheres));
  // At most 256 buckets: streams that fit in the TLB.
  const unsigned bucket_bits = bits > 18 ? bits - 8 : kPartBits;
  const std::size_t buckets = (spheres >> bucket_bits) + 1;
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
  grouped_.reserve(sum, "pairs in rows");
  pool.run(chunks.size(), [&](std::size_t chunk) {
    std::uint64_t* next = offsets_.data() + chunk * buckets;
    for (const std::uint64_t p : chunks[chunk]) divided_[next[lower(p) >> bucket_bits]++] = p;
  });
  return bucket_bits;
}

}  // namespace cpu
}  // namespace JFPX_ABI
}  // namespace jfpx
