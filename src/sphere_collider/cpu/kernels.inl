/// Bodies of the kernels, for any instruction set. Included, once each, by the kernels_*.cpp, which
/// define `Simd`, and `RowSimd` for short runs of targets, in an anonymous namespace before. See
/// kernels.hpp for what may be used here.

// The filter. Let u = epsilon/2, R = r_a + r_b (exact), t = 2^-63 (float) or 2^-511 (double), the
// square root of the smallest normal number; reach >= r*(1 + 6u) + t. A pair is dropped iff D > W,
//     D = fl(fl(dx*dx + dy*dy) + dz*dz),   W = fl(w*w),   w = fl(reach_a + reach_b),
// where D is the very value whose root the exact test takes. Claim: the exact test then finds
// len > s, so no contact is dropped. w > R*(1 + 6u)*(1 - u) and w*w >= (2t)^2 is normal, so
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

/// One bit per target from `at` on: set if the filter keeps it.
template <class S>
inline std::uint32_t kept(const Query<S>& q, const SphereColumns& t, std::uint32_t at) {
  const typename S::Vec dx = S::sub(q.x, S::load(t.x + at));
  const typename S::Vec dy = S::sub(q.y, S::load(t.y + at));
  const typename S::Vec dz = S::sub(q.z, S::load(t.z + at));
  const typename S::Vec w = S::add(q.reach, S::load(t.reach + at));
  const typename S::Vec square = S::add(S::add(S::mul(dx, dx), S::mul(dy, dy)), S::mul(dz, dz));
  return S::not_greater(square, S::mul(w, w));
}

/// Appends pairs. A copy of the sink's pointers, so that they stay in registers.
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

/// What the instruction sets without a compress instruction use.
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

void search_all(const PairSearch& s) {
  constexpr std::uint32_t kLanes = Simd::kLanes;
  Appender pairs(s.sink);
  const SphereColumns queries = s.queries;  // copies: vector stores may alias anything else
  const SphereColumns targets = s.targets;
  const bool self = s.self;
  const std::uint32_t last = s.last;
  const std::uint32_t count = targets.count;
  for (std::uint32_t i = s.first; i < last; ++i) {
    const Query<Simd> q = load_query<Simd>(queries, i);
    std::uint32_t at = self ? i + 1 : 0;
    // Two vectors a turn halve the branches on what is mostly empty.
    for (; at + 2 * kLanes <= count; at += 2 * kLanes) {
      const std::uint32_t first = kept(q, targets, at);
      const std::uint32_t second = kept(q, targets, at + kLanes);
      if ((first | second) == 0) continue;
      pairs.append<Simd>(q.id, targets.id + at, first);
      pairs.append<Simd>(q.id, targets.id + at + kLanes, second);
    }
    for (; at < count; at += kLanes) {
      const std::uint32_t left = count - at;
      const std::uint32_t valid = left < kLanes ? (1u << left) - 1 : ~0u;
      const std::uint32_t mask = kept(q, targets, at) & valid;
      if (mask != 0) pairs.append<Simd>(q.id, targets.id + at, mask);
    }
  }
}

/// Targets of cells [low, high), from row.cursor on. Cells ascend, so both bounds cut a prefix off
/// each vector: no table of cells, no unpredictable branch.
inline void search_row(const Query<RowSimd>& q, const SphereColumns& t, std::int64_t low,
                       std::int64_t high, std::uint32_t* cursor, Appender* pairs) {
  constexpr std::uint32_t kLanes = RowSimd::kLanes;
  std::uint32_t passed = 0;
  std::uint32_t at = *cursor;
  for (;;) {
    const std::uint32_t below = RowSimd::cells_below(t.cell + at, low);
    const std::uint32_t inside = RowSimd::cells_below(t.cell + at, high);
    passed += RowSimd::count(below);
    pairs->append<RowSimd>(q.id, t.id + at, kept(q, t, at) & inside & ~below);
    if (inside != RowSimd::kAll) [[likely]]
      break;
    at += kLanes;
  }
  *cursor += passed;
}

void search_rows(const PairSearch& s, CellRow* rows, int row_count) {
  Appender pairs(s.sink);
  const SphereColumns queries = s.queries;  // copies: vector stores may alias anything else
  const SphereColumns targets = s.targets;
  const bool self = s.self;
  const std::uint32_t last = s.last;
  for (std::uint32_t i = s.first; i < last; ++i) {
    const Query<RowSimd> q = load_query<RowSimd>(queries, i);
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
