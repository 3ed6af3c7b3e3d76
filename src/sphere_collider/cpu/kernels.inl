/// Definitions of the kernels, as templates over a vector type. Each kernels_*.cpp includes this
/// file, defines its vector type and instantiates the kernels for it. kernels.hpp states the
/// restrictions that apply here.
#include "src/sphere_collider/cpu/kernels.hpp"

// A vector type S has the following members; masks have one bit per lane.
//   kLanes                    number of lanes, at most kMaxLanes
//   Vec                       vector of kLanes Reals, with the operators + - *
//   load(p), set(v)           read kLanes Reals from p; set all lanes to v
//   store(p, v)               write kLanes Reals to p
//   square_root(v)            of each lane
//   not_greater(a, b)         mask of the lanes for which a > b is false
//   cells_below(cell, bound)  mask of the cells, out of kLanes, that are less than bound
//   ids_above(ids, bound)     mask of the ids, out of kLanes, that are greater than bound
//   copy_ids(from, to)        copies kLanes ids
//   count(mask)               number of set bits
//   append(out, id, others, mask)  see append_bits(); may write kLanes elements

// The test. It compares the values of detail::test_sphere_pair(). Exchanging the spheres changes
// the sign of the differences, but not their squares; the sum of two radii does not depend on the
// order.

// The filter, which takes no root. Let u = epsilon/2, R = r_a + r_b (exact), t = 2^-63 (float) or
// 2^-511 (double), the square root of the smallest normal number; reach >= r*(1 + 6u) + t. A pair
// is dropped iff D > W,
//     D = fl(fl(dx*dx + dy*dy) + dz*dz),   W = fl(w*w),   w = fl(reach_a + reach_b),
// where D is the same value of which the exact test takes the root. Claim: the exact test then
// finds len > s, so no contact is dropped. w > R*(1 + 6u)*(1 - u) and w*w >= (2t)^2 is normal, so
//     D > W >= w*w*(1 - u) > R^2 * (1 + 8u)   and   len >= sqrt(D)*(1 - u) > R*(1 + 2u) > s,
// since s = fl(R) <= R*(1 + u). If w*w overflows, W = inf drops nothing. If D overflows and W does
// not, len = inf > w >= s. Centres and radii are finite: differences may be infinite, their squares
// are never negative, so no NaN arises.

// Most kept pairs touch, and the squares can also show this: a pair touches if I > D, with
//     I = fl(W - fl(fl(W*64u) + m)),   m = 128 t^2/u.
// Since reach <= r*(1 + 15u) + 3t,
//     W <= R^2 * (1 + 37u) + 16tR + 50t^2 <= R^2 * (1 + 41u) + 65t^2/u,
// so D < I < R^2 * (1 - 20u) < s^2 and len <= s. If W overflows, I is NaN and decides nothing.

namespace jfpx {
inline namespace JFPX_ABI {
namespace cpu {
namespace {

#if defined(JFPX_DOUBLE_PRECISION)
constexpr Real kEps = __DBL_EPSILON__;
constexpr Real kMin = __DBL_MIN__;
#else
constexpr Real kEps = __FLT_EPSILON__;
constexpr Real kMin = __FLT_MIN__;
#endif
constexpr Real kBand = 32 * kEps;            ///< 64u
constexpr Real kMargin = 256 * kMin / kEps;  ///< m

template <class S>
struct Query {
  typename S::Vec x, y, z, radius, reach;
  std::uint32_t id;
};

template <class S>
inline Query<S> load_query(const SphereColumns& q, std::uint32_t i) {
  return {S::set(q.x[i]),      S::set(q.y[i]),     S::set(q.z[i]),
          S::set(q.radius[i]), S::set(q.reach[i]), q.id[i]};
}

/// Squares of the distances of the centres of the targets, starting at `at`.
template <class S>
inline typename S::Vec squares(const Query<S>& q, const SphereColumns& t, std::uint32_t at) {
  const typename S::Vec dx = q.x - S::load(t.x + at);
  const typename S::Vec dy = q.y - S::load(t.y + at);
  const typename S::Vec dz = q.z - S::load(t.z + at);
  return dx * dx + dy * dy + dz * dz;
}

/// Returns one bit per target: set if the filter keeps the target with this square.
template <class S>
inline std::uint32_t kept(typename S::Vec square, const Query<S>& q, const SphereColumns& t,
                          std::uint32_t at) {
  const typename S::Vec w = q.reach + S::load(t.reach + at);
  return S::not_greater(square, w * w);
}

/// Returns one bit per target: set if the target with this square touches.
template <class S>
inline std::uint32_t touching(typename S::Vec square, const Query<S>& q, const SphereColumns& t,
                              std::uint32_t at) {
  return S::not_greater(S::square_root(square), q.radius + S::load(t.radius + at));
}
template <class S>
inline std::uint32_t touching(const Query<S>& q, const SphereColumns& t, std::uint32_t at) {
  return touching<S>(squares(q, t, at), q, t, at);
}

/// Returns the bits of `targets` that touch. Computes roots only if the squares do not decide.
template <class S>
inline std::uint32_t touching_among(std::uint32_t targets, const Query<S>& q,
                                    const SphereColumns& t, std::uint32_t at) {
  const typename S::Vec square = squares(q, t, at);
  const typename S::Vec w = q.reach + S::load(t.reach + at);
  const typename S::Vec outer = w * w;
  const typename S::Vec inner = outer - (outer * S::set(kBand) + S::set(kMargin));
  targets &= S::not_greater(square, outer);
  if ((targets & S::not_greater(inner, square)) != 0) [[unlikely]]
    targets &= touching<S>(square, q, t, at);
  return targets;
}

/// Appends pairs. Copies the pointers of the sink, so that they stay in registers.
class Appender {
 public:
  explicit Appender(PairSink* sink) : sink_(sink), next_(sink->next), end_(sink->end) {}
  ~Appender() { sink_->next = next_; }
  Appender(const Appender&) = delete;
  Appender& operator=(const Appender&) = delete;

  /// Reserves room for kRoom pairs.
  void reserve() {
    if (end_ - next_ < kRoom) [[unlikely]] {
      sink_->next = next_;
      sink_->grow(sink_);
      next_ = sink_->next;
      end_ = sink_->end;
    }
  }

  /// Requires room for kMaxLanes pairs.
  template <class S>
  void put(std::uint32_t id, const std::uint32_t* others, std::uint32_t mask) {
    next_ = S::append(next_, id, others, mask);
  }

  template <class S>
  void append(std::uint32_t id, const std::uint32_t* others, std::uint32_t mask) {
    reserve();
    put<S>(id, others, mask);
  }

 private:
  PairSink* sink_;
  std::uint64_t* next_;
  std::uint64_t* end_;
};

/// Appends the pairs of `id` with those of `others` whose mask bit is set and returns the new end.
/// For instruction sets without a compress instruction.
[[maybe_unused]] inline std::uint64_t* append_bits(std::uint64_t* out, std::uint32_t id,
                                                   const std::uint32_t* others,
                                                   std::uint32_t mask) {
  for (; mask != 0; mask &= mask - 1) {
    const std::uint32_t other = others[__builtin_ctz(mask)];
    const std::uint32_t low = id < other ? id : other;
    const std::uint32_t high = id < other ? other : id;
    *out++ = (static_cast<std::uint64_t>(low) << 32) | high;
  }
  return out;
}

/// Aligned, because the time of the inner loop depends on its offset in a cache line by up to 19 %
/// (bench/results/highway.md).
template <class S>
[[gnu::aligned(64)]] void search_all(const PairSearch& search) {
  constexpr std::uint32_t kLanes = S::kLanes;
  Appender pairs(search.sink);
  const SphereColumns queries = search.queries;  // copies: vector stores may alias all other memory
  const SphereColumns targets = search.targets;
  const bool self = search.self;
  const std::uint32_t last = search.last;
  const std::uint32_t count = targets.count;
  for (std::uint32_t i = search.first; i < last; ++i) {
    const Query<S> q = load_query<S>(queries, i);
    std::uint32_t at = self ? i + 1 : 0;
    // Two vectors per iteration halve the number of branches on masks that are mostly zero.
    for (; at + 2 * kLanes <= count; at += 2 * kLanes) {
      const typename S::Vec first = squares(q, targets, at);
      const typename S::Vec second = squares(q, targets, at + kLanes);
      const std::uint32_t first_kept = kept<S>(first, q, targets, at);
      const std::uint32_t second_kept = kept<S>(second, q, targets, at + kLanes);
      if ((first_kept | second_kept) == 0) continue;
      if (first_kept != 0)
        pairs.append<S>(q.id, targets.id + at, touching<S>(first, q, targets, at));
      if (second_kept != 0)
        pairs.append<S>(q.id, targets.id + at + kLanes,
                        touching<S>(second, q, targets, at + kLanes));
    }
    for (; at < count; at += kLanes) {
      const std::uint32_t left = count - at;
      const std::uint32_t valid = left < kLanes ? (1u << left) - 1 : ~0u;
      const std::uint32_t mask = touching(q, targets, at) & valid;
      if (mask != 0) pairs.append<S>(q.id, targets.id + at, mask);
    }
  }
}

/// Tests the targets in cells [low, high), starting at the cursor. Cells ascend, so each bound
/// selects a prefix of each vector, without a table of cells and without an unpredictable branch.
/// Requires room for one vector of pairs, and preserves the room for the following rows.
template <class S>
inline void search_row(const Query<S>& q, const SphereColumns& t, std::int64_t low,
                       std::int64_t high, std::uint32_t* cursor, Appender* pairs) {
  constexpr std::uint32_t kAll = (1u << S::kLanes) - 1;
  std::uint32_t passed = 0;
  std::uint32_t at = *cursor;
  for (;;) {
    const std::uint32_t below = S::cells_below(t.cell + at, low);
    const std::uint32_t inside = S::cells_below(t.cell + at, high);
    passed += S::count(below);
    pairs->put<S>(q.id, t.id + at, touching_among(inside ^ below, q, t, at));
    if (inside != kAll) [[likely]]
      break;
    at += S::kLanes;
    pairs->reserve();
  }
  *cursor += passed;
}

template <class S>
void search_rows(const PairSearch& search, CellRow* rows, int row_count) {
  Appender pairs(search.sink);
  const SphereColumns queries = search.queries;  // copies: vector stores may alias all other memory
  const SphereColumns targets = search.targets;
  const bool self = search.self;
  const std::uint32_t last = search.last;
  for (std::uint32_t i = search.first; i < last; ++i) {
    const Query<S> q = load_query<S>(queries, i);
    const std::int64_t cell = queries.cell[i];
    int row = 0;
    pairs.reserve();  // once for all rows, unless one has several vectors
    if (self) {
      std::uint32_t behind = i + 1;
      search_row(q, targets, cell, cell + 2, &behind, &pairs);
      row = 1;
    }
    for (; row < row_count; ++row) {
      const std::int64_t low = cell + rows[row].offset;
      search_row(q, targets, low, low + 3, &rows[row].cursor, &pairs);
    }
  }
}

/// Consecutive targets.
struct TargetRun {
  std::uint32_t begin, end;
};

/// Returns the targets in cells [low, high), starting at the cursor, which advances to the first.
/// Cells ascend, so each bound selects a prefix of each vector, without a table of cells and
/// without an unpredictable branch.
template <class S>
inline TargetRun find_run(const SphereColumns& t, std::int64_t low, std::int64_t high,
                          std::uint32_t* cursor) {
  const auto first_at_least = [&](std::int64_t bound, std::uint32_t at) {
    for (;;) {
      const std::uint32_t below = S::count(S::cells_below(t.cell + at, bound));
      at += below;
      if (below < S::kLanes) [[likely]]
        return at;
    }
  };
  *cursor = first_at_least(low, *cursor);
  return {*cursor, first_at_least(high, *cursor)};
}

/// Appends the targets of a run that touch; if `self`, only those with higher ids.
template <class S>
inline void search_run(const Query<S>& q, const SphereColumns& t, TargetRun run, bool self,
                       Appender* pairs) {
  for (std::uint32_t at = run.begin; at < run.end; at += S::kLanes) {
    const std::uint32_t left = run.end - at;
    std::uint32_t mask = touching(q, t, at);
    if (self) mask &= S::ids_above(t.id + at, q.id);
    if (left < S::kLanes) mask &= (1u << left) - 1;
    pairs->append<S>(q.id, t.id + at, mask);
  }
}

/// Copies of the targets around a cell, without gaps.
struct NearTargets {
  static constexpr std::uint32_t kCapacity = 1024;
  static constexpr std::uint32_t kSize = kCapacity + kMaxLanes;

  SphereColumns columns() const { return {x, y, z, radius, nullptr, id, nullptr, kCapacity}; }

  template <class S>
  void copy(const SphereColumns& t, const TargetRun* runs) {
    std::uint32_t end = 0;
    for (std::uint32_t row = 0; row < kRows; ++row) {
      const TargetRun run = runs[row];
      for (std::uint32_t at = run.begin, to = end; at < run.end; at += S::kLanes, to += S::kLanes) {
        S::store(x + to, S::load(t.x + at));
        S::store(y + to, S::load(t.y + at));
        S::store(z + to, S::load(t.z + at));
        S::store(radius + to, S::load(t.radius + at));
        S::copy_ids(t.id + at, id + to);
      }
      end += run.end - run.begin;
    }
    // Vectors read beyond the last target.
    S::store(x + end, S::set(0));
    S::store(y + end, S::set(0));
    S::store(z + end, S::set(0));
    S::store(radius + end, S::set(0));
  }

  alignas(64) Real x[kSize];
  alignas(64) Real y[kSize];
  alignas(64) Real z[kSize];
  alignas(64) Real radius[kSize];
  alignas(64) std::uint32_t id[kSize];
};

/// The queries of a cell have the same targets. Few targets are copied together, so that vectors
/// are full.
template <class S>
void search_cells(const PairSearch& search, CellRow* rows) {
  Appender pairs(search.sink);
  const SphereColumns queries = search.queries;  // copies: vector stores may alias all other memory
  const SphereColumns targets = search.targets;
  const bool self = search.self;
  const std::uint32_t last = search.last;
  NearTargets near;  // NOLINT(cppcoreguidelines-pro-type-member-init): written before it is read
  for (std::uint32_t i = search.first; i < last;) {
    const std::int64_t cell = queries.cell[i];
    std::uint32_t end = i + 1;
    while (end < last && queries.cell[end] == cell) ++end;
    TargetRun runs[kRows];
    std::uint64_t total = 0;
    for (std::uint32_t row = 0; row < kRows; ++row) {
      const std::int64_t low = cell + rows[row].offset;
      runs[row] = find_run<S>(targets, low, low + 3, &rows[row].cursor);
      total += runs[row].end - runs[row].begin;
    }
    const bool copied = total <= NearTargets::kCapacity;
    if (copied) near.template copy<S>(targets, runs);
    for (; i < end; ++i) {
      const Query<S> q = load_query<S>(queries, i);
      if (copied) {
        search_run<S>(q, near.columns(), {0, static_cast<std::uint32_t>(total)}, self, &pairs);
      } else {
        for (const TargetRun& run : runs) search_run<S>(q, targets, run, self, &pairs);
      }
    }
  }
}

}  // namespace
}  // namespace cpu
}  // namespace JFPX_ABI
}  // namespace jfpx
