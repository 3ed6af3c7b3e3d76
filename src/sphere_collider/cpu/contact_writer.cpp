/// Count, scan and emit: every pair is written once, at a position that does not depend on the
/// thread.
#include "src/sphere_collider/cpu/contact_writer.hpp"

#include "src/base/interrupt.hpp"
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

constexpr unsigned kPartBits = 10;       ///< minimum bits of the rows per part of the result
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

/// Writes a row of at most `Capacity` pairs sorted: the position of a pair is the number of lower
/// pairs. The order of a row is random, so branches on comparisons would be unpredictable; these
/// loops are branch-free, and compilers vectorize them.
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

/// Writes a sorted row of `Count` pairs, in registers.
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

/// The contact of a touching pair.
SphereContact contact_of(const SphereInstance* spheres, const SpherePair& p) {
  const PairResult r = detail::test_sphere_pair(spheres[p.a], spheres[p.b]);
  return {p.a, p.b, r.normal, r.distance};
}

/// The contacts of kRealLanes touching pairs.
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
  run_interruptible(pool, chunks.size(), [&](std::size_t i) {
    std::transform(chunks[i].begin(), chunks[i].end(), items->data() + sections_[i], make);
  });
  return {items->data(), total};
}

/// Writes pairs in parts of consecutive rows. Calls reserve(total) before the first part, and
/// done(pairs) after each part, while it is in the cache.
template <class Reserve, class Done>
std::span<const SpherePair> ContactWriter::write_rows(std::size_t spheres, const PairChunks& chunks,
                                                      PairOrder order, ThreadPool& pool,
                                                      const Reserve& reserve, const Done& done) {
  const bool grouped = order == PairOrder::by_lower_sphere;
  const unsigned part_bits =
      grouped ? index_rows(chunks, spheres, pool) : divide(chunks, spheres, pool);
  const std::size_t parts = (spheres >> part_bits) + 1;
  const std::uint64_t total = sections_[parts];
  pairs_.reserve(total, "pairs");
  reserve(total);
  const std::size_t rows_per_part = std::size_t{1} << part_bits;
  reserve_workspaces(std::min<std::size_t>(parts, pool.threads()), grouped ? 0 : rows_per_part,
                     parts);
  run_interruptible(pool, parts, [&](std::size_t part) {
    const std::size_t first = part << part_bits;
    const std::size_t last = std::min(spheres, first + rows_per_part);
    if (first >= last) return;
    const auto workspace = take_workspace();
    const Row* const rows =
        grouped ? rows_.data() + first : make_rows(part, first, last, workspace.get());
    SpherePair* const begin = pairs_.data() + sections_[part];
    SpherePair* end = begin;
    for (std::size_t a = 0; a < last - first; ++a) {
      prefetch(rows[std::min(a + kRowsAhead, last - first - 1)]);
      sort_row(rows[a].pairs, rows[a].count, end, &workspace->spare);
      end += rows[a].count;
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
  rows_.reserve(spheres, "rows of pairs");
  std::fill_n(rows_.data(), spheres, Row{});
  run_interruptible(pool, chunks.size(), [&](std::size_t chunk) {
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

/// Creates a workspace for each thread. Only a long row grows a workspace later.
/// @param rows number of rows of a part that make_rows() fills
void ContactWriter::reserve_workspaces(std::size_t count, std::size_t rows, std::size_t parts) {
  std::uint64_t most = 0;
  for (std::size_t i = 0; rows > 0 && i < parts; ++i) {
    most = std::max(most, sections_[i + 1] - sections_[i]);
  }
  if (workspaces_.size() < count) workspaces_.resize(count);
  idle_.clear();
  for (Workspace& workspace : workspaces_) {
    workspace.pairs.reserve(most, "pairs in rows");
    workspace.rows.reserve(rows, "rows of pairs");
    idle_.push_back(&workspace);
  }
}

ContactWriter::TakenWorkspace ContactWriter::take_workspace() {
  const std::lock_guard lock(mutex_);
  Workspace* const taken = idle_.back();
  idle_.pop_back();
  return {taken, GiveBack{this}};
}

void ContactWriter::GiveBack::operator()(Workspace* workspace) const {
  const std::lock_guard lock(writer->mutex_);
  writer->idle_.push_back(workspace);
}

/// Moves the pairs of a bucket of neighbouring lower spheres [first, last) to the workspace, by
/// lower sphere. Returns their rows.
const ContactWriter::Row* ContactWriter::make_rows(std::size_t bucket, std::size_t first,
                                                   std::size_t last, Workspace* workspace) const {
  const std::span<const SpherePair> own(pairs_.data() + sections_[bucket],
                                        pairs_.data() + sections_[bucket + 1]);
  Row* const rows = workspace->rows.data();
  std::uint64_t* const pairs = workspace->pairs.data();
  std::fill_n(rows, last - first, Row{});
  const auto row_of = [&](std::uint64_t pair) -> Row& { return rows[lower(pair) - first]; };
  for (const SpherePair& bits : own) ++row_of(std::bit_cast<std::uint64_t>(bits)).count;
  std::uint64_t* end = pairs;
  for (std::size_t a = 0; a < last - first; ++a) rows[a].pairs = end += rows[a].count;
  for (const SpherePair& bits : own) {  // from the ends of the rows to their begins
    const auto p = std::bit_cast<std::uint64_t>(bits);
    pairs[--row_of(p).pairs - pairs] = p;
  }
  return rows;
}

/// Divides pairs into buckets of neighbouring lower spheres, so that later passes stay in the cache
/// of one core. Fills sections_, and pairs_ with the bits of packed pairs. Returns the bits of the
/// size of a bucket.
unsigned ContactWriter::divide(const PairChunks& chunks, std::size_t spheres, ThreadPool& pool) {
  const auto bits = static_cast<unsigned>(std::bit_width(spheres));
  // At most 256 buckets, whose streams fit in the TLB.
  const unsigned bucket_bits = bits > 18 ? bits - 8 : kPartBits;
  const std::size_t buckets = (spheres >> bucket_bits) + 1;
  offsets_.reserve(chunks.size() * buckets, "counts of pairs");
  run_interruptible(pool, chunks.size(), [&](std::size_t chunk) {
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
  pairs_.reserve(sum, "pairs");
  run_interruptible(pool, chunks.size(), [&](std::size_t chunk) {
    std::uint64_t* next = offsets_.data() + chunk * buckets;
    for (const std::uint64_t p : chunks[chunk]) {
      pairs_[next[lower(p) >> bucket_bits]++] = std::bit_cast<SpherePair>(p);
    }
  });
  return bucket_bits;
}

}  // namespace cpu
}  // namespace JFPX_ABI
}  // namespace jfpx
