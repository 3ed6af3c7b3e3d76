/// Definitions of the kernels, as templates over a vector type. Each kernels_*.cpp includes this
/// file, defines its vector type and instantiates the kernels for it. kernels.hpp states the
/// restrictions that apply here.
#include "src/sphere_collider/cpu/kernels.hpp"

// A vector type S has the following members; masks have one bit per lane.
//   kLanes                    number of lanes, at most kMaxLanes
//   Vec                       vector of kLanes Reals, with the operators + - *
//   load(p), set(v)           read kLanes Reals from p; set all lanes to v
//   not_greater(a, b)         mask of the lanes for which a > b is false
//   cells_below(cell, bound)  mask of the cells, out of kLanes, that are less than bound
//   count(mask)               number of set bits
//   append(out, id, others, mask)  see append_bits(); may write kLanes elements

// The filter. Let u = epsilon/2, R = r_a + r_b (exact), t = 2^-63 (float) or 2^-511 (double), the
// square root of the smallest normal number; reach >= r*(1 + 6u) + t. A pair is dropped iff D > W,
//     D = fl(fl(dx*dx + dy*dy) + dz*dz),   W = fl(w*w),   w = fl(reach_a + reach_b),
// where D is the same value of which the exact test takes the root. Claim: the exact test then
// finds len > s, so no contact is dropped. w > R*(1 + 6u)*(1 - u) and w*w >= (2t)^2 is normal, so
//     D > W >= w*w*(1 - u) > R^2 * (1 + 8u)   and   len >= sqrt(D)*(1 - u) > R*(1 + 2u) > s,
// since s = fl(R) <= R*(1 + u). If w*w overflows, W = inf drops nothing. If D overflows and W does
// not, len = inf > w >= s. Centres and radii are finite: differences may be infinite, their squares
// are never negative, so no NaN arises.

namespace jfpx {
inline namespace JFPX_ABI {
namespace cpu {
namespace {

template <class S>
struct Query {
  typename S::Vec x, y, z, reach;
  std::uint32_t id;
};

template <class S>
inline Query<S> load_query(const SphereColumns& q, std::uint32_t i) {
  return {S::set(q.x[i]), S::set(q.y[i]), S::set(q.z[i]), S::set(q.reach[i]), q.id[i]};
}

/// Returns one bit per target, starting at `at`: set if the filter keeps the target.
template <class S>
inline std::uint32_t kept(const Query<S>& q, const SphereColumns& t, std::uint32_t at) {
  const typename S::Vec dx = q.x - S::load(t.x + at);
  const typename S::Vec dy = q.y - S::load(t.y + at);
  const typename S::Vec dz = q.z - S::load(t.z + at);
  const typename S::Vec w = q.reach + S::load(t.reach + at);
  const typename S::Vec square = dx * dx + dy * dy + dz * dz;
  return S::not_greater(square, w * w);
}

/// Appends pairs. Copies the pointers of the sink, so that they stay in registers.
class Appender {
 public:
  explicit Appender(PairSink* sink) : sink_(sink), next_(sink->next), end_(sink->end) {}
  ~Appender() { sink_->next = next_; }
  Appender(const Appender&) = delete;
  Appender& operator=(const Appender&) = delete;

  template <class S>
  void append(std::uint32_t id, const std::uint32_t* others, std::uint32_t mask) {
    if (end_ - next_ < kMaxLanes) [[unlikely]] {
      sink_->next = next_;
      sink_->grow(sink_);
      next_ = sink_->next;
      end_ = sink_->end;
    }
    next_ = S::append(next_, id, others, mask);
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
      const std::uint32_t first = kept(q, targets, at);
      const std::uint32_t second = kept(q, targets, at + kLanes);
      if ((first | second) == 0) continue;
      pairs.append<S>(q.id, targets.id + at, first);
      pairs.append<S>(q.id, targets.id + at + kLanes, second);
    }
    for (; at < count; at += kLanes) {
      const std::uint32_t left = count - at;
      const std::uint32_t valid = left < kLanes ? (1u << left) - 1 : ~0u;
      const std::uint32_t mask = kept(q, targets, at) & valid;
      if (mask != 0) pairs.append<S>(q.id, targets.id + at, mask);
    }
  }
}

/// Tests the targets in cells [low, high), starting at the cursor. Cells ascend, so each bound
/// selects a prefix of each vector. This needs neither a table of cells nor an unpredictable
/// branch.
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
    pairs->append<S>(q.id, t.id + at, kept(q, t, at) & inside & ~below);
    if (inside != kAll) [[likely]]
      break;
    at += S::kLanes;
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

}  // namespace
}  // namespace cpu
}  // namespace JFPX_ABI
}  // namespace jfpx
