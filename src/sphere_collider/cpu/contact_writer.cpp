/// Count, scan and emit: every contact is written once, at a position that does not depend on the
/// thread. Pairs are first divided into buckets of neighbouring lower spheres, so that the rest of
/// the sort stays in the cache of one core.
#include "src/sphere_collider/cpu/contact_writer.hpp"

#include "src/collide/sphere_pair.hpp"

#include <algorithm>
#include <bit>
#include <numeric>

namespace jfpx {
inline namespace JFPX_ABI {
namespace cpu {
namespace {

std::uint32_t lower(std::uint64_t pair) { return static_cast<std::uint32_t>(pair >> 32); }
std::uint32_t higher(std::uint64_t pair) { return static_cast<std::uint32_t>(pair); }

/// Applies the exact test; appends the contact if there is one.
SphereContact* append_contact(std::span<const SphereInstance> spheres, std::uint32_t a,
                              std::uint32_t b, SphereContact* out) {
  const PairResult r = detail::test_sphere_pair(spheres[a], spheres[b]);
  if (r.touching == 0) return out;
  *out = {a, b, r.normal, r.distance};
  return out + 1;
}

/// LSD radix sort by the higher sphere, for rows that are too long for a comparison sort.
void sort_long_row(std::uint64_t* row, std::uint64_t* spare, std::size_t count) {
  constexpr unsigned kBits = 11;
  std::uint64_t* const home = row;
  std::uint32_t largest = 0;
  for (std::size_t i = 0; i < count; ++i) largest = std::max(largest, higher(row[i]));
  const auto bits = static_cast<unsigned>(std::bit_width(largest));
  for (unsigned shift = 0; shift < bits; shift += kBits) {
    std::size_t next[1u << kBits] = {};
    const auto digit = [&](std::uint64_t p) { return (p >> shift) & ((1u << kBits) - 1); };
    for (std::size_t i = 0; i < count; ++i) ++next[digit(row[i])];
    std::exclusive_scan(std::begin(next), std::end(next), std::begin(next), std::size_t{0});
    for (std::size_t i = 0; i < count; ++i) spare[next[digit(row[i])]++] = row[i];
    std::swap(row, spare);
  }
  if (row != home) std::copy_n(row, count, home);
}

/// Sorts in registers by compare-exchange. The order of a row is random, so branches on comparisons
/// would be unpredictable. (Copies the values, because the first assignment of the exchange would
/// overwrite the object to which std::min refers.)
template <std::size_t Count>
void sort_short_row(std::uint64_t* row) {
  std::uint64_t v[Count];
  std::copy_n(row, Count, v);
#pragma GCC unroll 8
  for (std::size_t i = 1; i < Count; ++i) {
#pragma GCC unroll 8
    for (std::size_t j = i; j > 0; --j) {
      const std::uint64_t left = v[j - 1];
      const std::uint64_t right = v[j];
      v[j - 1] = right < left ? right : left;
      v[j] = right < left ? left : right;
    }
  }
  std::copy_n(v, Count, row);
}

/// Sorts a row: pairs with the same lower sphere.
void sort_row(std::uint64_t* row, std::uint64_t* spare, std::size_t count) {
  switch (count) {
    case 0:
    case 1:
      return;
    case 2:
      return sort_short_row<2>(row);
    case 3:
      return sort_short_row<3>(row);
    case 4:
      return sort_short_row<4>(row);
    case 5:
      return sort_short_row<5>(row);
    case 6:
      return sort_short_row<6>(row);
    default:
      return count > 512 ? sort_long_row(row, spare, count) : std::sort(row, row + count);
  }
}

}  // namespace

ContactSpan ContactWriter::write_sorted(std::span<const SphereInstance> spheres,
                                        const PairChunks& pairs, ThreadPool& pool) {
  sections_.reserve(pairs.size() + 1, "sections of contacts");
  std::uint64_t sum = 0;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    sections_[i] = {sum, 0};
    sum += pairs[i].size();
  }
  contacts_.reserve(sum, "contacts");
  pool.run(pairs.size(), [&](std::size_t i) {
    SphereContact* const begin = contacts_.data() + sections_[i].begin;
    SphereContact* out = begin;
    for (const std::uint64_t p : pairs[i]) {
      out = append_contact(spheres, lower(p), higher(p), out);
    }
    sections_[i].touching = static_cast<std::uint64_t>(out - begin);
  });
  return close_gaps(pairs.size());
}

ContactSpan ContactWriter::write_unsorted(std::span<const SphereInstance> spheres,
                                          const PairChunks& pairs, ThreadPool& pool) {
  const auto bits = static_cast<unsigned>(std::bit_width(spheres.size()));
  bucket_bits_ = bits > 18 ? bits - 8 : 10;  // at most 256 buckets: streams that fit in the TLB
  buckets_ = (spheres.size() >> bucket_bits_) + 1;
  row_end_.reserve(buckets_ << bucket_bits_, "rows of pairs");
  divide(pairs, pool);
  const std::uint64_t total = sections_[buckets_].begin;
  rows_.reserve(total, "pairs in rows");
  contacts_.reserve(total, "contacts");
  pool.run(buckets_, [&](std::size_t bucket) {
    make_rows(bucket, spheres.size());
    sections_[bucket].touching = write_rows(spheres, bucket);
  });
  return close_gaps(buckets_);
}

void ContactWriter::divide(const PairChunks& pairs, ThreadPool& pool) {
  offsets_.reserve(pairs.size() * buckets_, "counts of pairs");
  pool.run(pairs.size(), [&](std::size_t chunk) {
    std::uint64_t* counts = offsets_.data() + chunk * buckets_;
    std::fill_n(counts, buckets_, 0u);
    for (const std::uint64_t p : pairs[chunk]) ++counts[lower(p) >> bucket_bits_];
  });
  sections_.reserve(buckets_ + 1, "sections of contacts");
  std::uint64_t sum = 0;
  for (std::size_t bucket = 0; bucket < buckets_; ++bucket) {
    sections_[bucket] = {sum, 0};
    for (std::size_t chunk = 0; chunk < pairs.size(); ++chunk) {
      std::uint64_t& offset = offsets_[chunk * buckets_ + bucket];
      sum += std::exchange(offset, sum);
    }
  }
  sections_[buckets_] = {sum, 0};
  divided_.reserve(sum, "pairs in buckets");
  pool.run(pairs.size(), [&](std::size_t chunk) {
    std::uint64_t* next = offsets_.data() + chunk * buckets_;
    for (const std::uint64_t p : pairs[chunk]) divided_[next[lower(p) >> bucket_bits_]++] = p;
  });
}

void ContactWriter::make_rows(std::size_t bucket, std::size_t spheres) {
  const std::uint64_t begin = sections_[bucket].begin;
  const std::uint64_t end = sections_[bucket + 1].begin;
  const std::size_t first = bucket << bucket_bits_;
  const std::size_t last = std::min(spheres, first + (std::size_t{1} << bucket_bits_));
  if (first >= last) return;
  std::fill(row_end_.data() + first, row_end_.data() + last, 0u);
  for (std::uint64_t i = begin; i < end; ++i) ++row_end_[lower(divided_[i])];
  std::exclusive_scan(row_end_.data() + first, row_end_.data() + last, row_end_.data() + first,
                      begin);
  for (std::uint64_t i = begin; i < end; ++i) {
    rows_[row_end_[lower(divided_[i])]++] = divided_[i];
  }
  // The pairs of the bucket have been copied, so their memory serves as scratch space.
  std::uint64_t row = begin;
  for (std::size_t a = first; a < last; ++a) {
    sort_row(rows_.data() + row, divided_.data() + begin, row_end_[a] - row);
    row = row_end_[a];
  }
}

std::uint64_t ContactWriter::write_rows(std::span<const SphereInstance> spheres,
                                        std::size_t bucket) {
  constexpr std::uint64_t kAhead = 16;  // prefetch distance: accesses to spheres are random
  const std::uint64_t begin = sections_[bucket].begin;
  const std::uint64_t end = sections_[bucket + 1].begin;
  SphereContact* out = contacts_.data() + begin;
  for (std::uint64_t i = begin; i < end; ++i) {
    if (i + kAhead < end) __builtin_prefetch(&spheres[higher(rows_[i + kAhead])]);
    out = append_contact(spheres, lower(rows_[i]), higher(rows_[i]), out);
  }
  return static_cast<std::uint64_t>(out - (contacts_.data() + begin));
}

/// Removes the gaps that remain where candidates do not touch.
ContactSpan ContactWriter::close_gaps(std::size_t sections) {
  SphereContact* out = contacts_.data();
  for (std::size_t i = 0; i < sections; ++i) {
    const SphereContact* from = contacts_.data() + sections_[i].begin;
    if (from != out) std::copy_n(from, sections_[i].touching, out);
    out += sections_[i].touching;
  }
  return {contacts_.data(), out};
}

}  // namespace cpu
}  // namespace JFPX_ABI
}  // namespace jfpx
