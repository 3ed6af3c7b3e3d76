/// Rows and sweeps of the soft step on the CPU; see the header.
#include "src/contact_solver/soft_step/cpu/soft_step_solver.hpp"

#include "src/base/cpu.hpp"
#include "src/base/parallel_for.hpp"
#include "src/base/prefetch.hpp"
#include "src/base/reserve.hpp"
#include "src/contact_solver/soft_step/cpu/frame_bundles.hpp"
#include "src/contact_solver/soft_step/row_operations.hpp"

#include <algorithm>
#include <bit>
#include <cstddef>
#include <map>
#include <mutex>
#include <numeric>
#include <tuple>
#include <type_traits>

namespace jfpx {
inline namespace JFPX_ABI {
namespace soft_step {
namespace {

/// Binary logarithm of the bodies of a part with fixed bodies, in a world of one block. In smaller
/// parts, more vectors of rows are incomplete.
constexpr unsigned kFixedPartBits = 7;
// Chunks take a few microseconds, so that small worlds have chunks for many threads.
constexpr std::size_t kContactsPerChunk = 512;
constexpr std::size_t kRowsPerKernel = 64;
constexpr std::size_t bundle_chunk(std::size_t bundles) { return chunk_size(bundles, 2, 8); }
static_assert(kRowsPerKernel % cpu::kBundle == 0);
/// Of a chunk of a color; of a color that one thread solves alone.
constexpr std::size_t kCostPerChunk = 64, kCostOfOneThread = 128;
/// Of a row of spheres: 1.
template <class Row>
constexpr std::size_t kCost = 2;
template <>
constexpr std::size_t kCost<SphereRow> = 1;
template <>
constexpr std::size_t kCost<ManifoldRow> = 4;

// The layout that sphere_sweep.hpp assumes.
constexpr std::size_t kReal = sizeof(Real);
static_assert(sizeof(SphereRow) == cpu::kSweepStride * kReal);
static_assert(offsetof(SphereRow, friction_impulse) == cpu::sphere_row_quad::kImpulses * kReal);
static_assert(offsetof(SphereRow, normal_impulse) == 3 * kReal);
static_assert(offsetof(SphereRow, normal) == cpu::sphere_row_quad::kNormal * kReal);
static_assert(offsetof(SphereRow, distance) == 7 * kReal);
static_assert(offsetof(SphereRow, friction) == cpu::sphere_row_quad::kFriction * kReal);
static_assert(offsetof(SphereRow, arm_a) == 9 * kReal && offsetof(SphereRow, arm_b) == 10 * kReal);
static_assert(offsetof(SphereRow, normal_mass) == 11 * kReal);
static_assert(offsetof(SphereRow, tangent_mass) == cpu::sphere_row_quad::kTangentMass * kReal);
static_assert(offsetof(SphereRow, a) == cpu::sphere_row_quad::kBodies * kReal);
static_assert(offsetof(SphereRow, b) == offsetof(SphereRow, a) + 4);
static_assert(sizeof(SolverBody) == cpu::kSweepStride * kReal);
static_assert(offsetof(SolverBody, inverse_mass) == 3 * kReal);
static_assert(offsetof(SolverBody, angular_velocity) ==
              cpu::solver_body_quad::kAngularVelocity * kReal);
static_assert(offsetof(SolverBody, inverse_inertia) == 7 * kReal);
static_assert(offsetof(SolverBody, shift) == cpu::solver_body_quad::kShift * kReal);

static_assert(offsetof(SolverBody, rotation) == cpu::solver_body_quad::kRotation * kReal);

// The layout that manifold_sweep.hpp assumes.
namespace manifold = cpu::manifold_row_offset;
static_assert(sizeof(ManifoldRow) == manifold::kStride * kReal);
static_assert(offsetof(ManifoldRow, a) == manifold::kNumbers * kReal);
static_assert(offsetof(ManifoldRow, b) == offsetof(ManifoldRow, a) + 4);
static_assert(offsetof(ManifoldRow, first) == offsetof(ManifoldRow, a) + 8);
static_assert(offsetof(ManifoldRow, count) == offsetof(ManifoldRow, a) + 12);
static_assert(offsetof(ManifoldRow, normal) == manifold::kNormal * kReal);
static_assert(offsetof(ManifoldRow, friction) == (manifold::kNormal + 3) * kReal);
static_assert(offsetof(ManifoldRow, tangent) == manifold::kTangent * kReal);
static_assert(offsetof(ManifoldRow, twist_arm) == (manifold::kTangent + 3) * kReal);
static_assert(offsetof(ManifoldRow, bitangent) == manifold::kBitangent * kReal);
static_assert(offsetof(ManifoldRow, twist_mass) == (manifold::kBitangent + 3) * kReal);
static_assert(offsetof(ManifoldRow, x) == manifold::kLeverX * kReal);
static_assert(offsetof(ManifoldRow, y) == manifold::kLeverY * kReal);
static_assert(offsetof(Lever, turn_b) == 3 * kReal && offsetof(Lever, spin_a) == 6 * kReal);
static_assert(offsetof(Lever, spin_b) == 9 * kReal && sizeof(Lever) == 12 * kReal);
static_assert(offsetof(ManifoldRow, twist_a) == manifold::kTwist * kReal);
static_assert(offsetof(ManifoldRow, xx) == (manifold::kTwist + 6) * kReal);
static_assert(offsetof(ManifoldRow, xy) == (manifold::kTwist + 7) * kReal);
static_assert(offsetof(ManifoldRow, friction_x) == manifold::kFrictionImpulses * kReal);
static_assert(offsetof(ManifoldRow, friction_y) == (manifold::kFrictionImpulses + 1) * kReal);
static_assert(offsetof(ManifoldRow, twist_impulse) == (manifold::kFrictionImpulses + 2) * kReal);
static_assert(offsetof(ManifoldRow, yy) == (manifold::kFrictionImpulses + 3) * kReal);
static_assert(offsetof(ManifoldRow, slip_mass) == manifold::kRolling * kReal);
static_assert(offsetof(ManifoldRow, rolling_friction) == (manifold::kRolling + 1) * kReal);
static_assert(offsetof(ManifoldRow, spinning_friction) == (manifold::kRolling + 2) * kReal);
static_assert(offsetof(ManifoldRow, is_jointed) == manifold::kIsJointed * kReal);
static_assert(cpu::kMostPoints == detail::PairManifold::kMaxPoints);
static_assert(sizeof(PointRow) == cpu::kSweepStride * kReal);
static_assert(offsetof(PointRow, turn_a) == cpu::point_row_quad::kTurnA * kReal);
static_assert(offsetof(PointRow, distance) == (cpu::point_row_quad::kTurnA + 3) * kReal);
static_assert(offsetof(PointRow, turn_b) == cpu::point_row_quad::kTurnB * kReal);
static_assert(offsetof(PointRow, normal_mass) == (cpu::point_row_quad::kTurnB + 3) * kReal);
static_assert(offsetof(PointRow, spin_a) == cpu::point_row_quad::kSpinA * kReal);
static_assert(offsetof(PointRow, normal_impulse) == (cpu::point_row_quad::kSpinA + 3) * kReal);
static_assert(offsetof(PointRow, spin_b) == cpu::point_row_quad::kSpinB * kReal);
static_assert(offsetof(PointRow, rebound) == (cpu::point_row_quad::kSpinB + 3) * kReal);

bool has_avx2(SimdLevel level) {
#if defined(__x86_64__)
  return level >= SimdLevel::avx2;
#else
  static_cast<void>(level);
  return false;
#endif
}

cpu::SweepConstants sweep_constants(const StepConstants& c) {
  return {c.h, c.inverse_h, c.push_out_speed, c.max_bias_velocity};
}
cpu::SweepSoftness softness(const Softness& s) {
  return {s.bias_rate, s.mass_scale, s.impulse_scale};
}

/// The lane of a row of a joint.
[[maybe_unused]] FrameLane frame_lane(const cpu::FrameSweep& sweep, std::size_t row) {
  const std::size_t bundle = row / cpu::kBundle;
  return {&sweep.numbers[bundle], sweep.rows + bundle * (cpu::frame_vector::kCount * cpu::kBundle),
          static_cast<unsigned>(row % cpu::kBundle)};
}

/// Whether a sweep solves only rows of joints.
bool is_of_joints(Sweep sweep) { return sweep == Sweep::first_joints || sweep == Sweep::joints; }

/// Whether a sweep solves rows of a type.
template <class Row>
bool takes_part(Sweep sweep) {
  return !is_of_joints(sweep) || kKindOf<Row> >= kContactRowKinds;
}

/// A number without a row.
void mark_unused(ManifoldRow* row) { row->count = 0; }
void mark_unused(FrameRow* row) { row->a = kWorld; }
bool is_used(const ManifoldRow& row) { return row.count > 0; }
bool is_used(const FrameRow& row) { return row.a != kWorld; }

/// The function of kernels for a sweep.
template <class Kernels>
auto function_of(const Kernels& kernels, Sweep sweep) {
  if (sweep == Sweep::warm_start) return kernels.warm_start;
  return kernels.solve[sweep == Sweep::relax ? 0 : 1];
}

}  // namespace

SoftStepSolver::SoftStepSolver(ThreadPool* pool, SimdLevel simd)
    : pool_(pool), uses_avx2_(has_avx2(usable_simd_level(simd))) {}

const cpu::BodySweepKernels* SoftStepSolver::body_kernels() const {
#if defined(__x86_64__)
  if (uses_avx2_) return &cpu::kAvx2BodySweep;
#endif
  return nullptr;
}

/// Fills kinds_ and shape_, and lists the contacts with fixed bodies and in the overflow.
void SoftStepSolver::inspect_contacts() {
  const std::uint32_t count = setup_.size();
  resize_geometric(&kinds_, count);
  listed_.clear();
  crossing_contacts_.clear();
  SpinLock mutex;
  struct Ends {
    std::uint32_t inner = 0, crossing = 0;
  };
  const auto inspect = [&](std::size_t first, std::size_t last) {
    Ends ends;
    std::array<ListedContact, 64> listed;
    std::size_t listed_count = 0;
    const auto flush = [&] {
      if (listed_count == 0) return;
      const std::lock_guard lock(mutex);
      listed_.insert(listed_.end(), listed.begin(), listed.begin() + listed_count);
      listed_count = 0;
    };
    for (auto i = static_cast<std::uint32_t>(first); i < last; ++i) {
      kinds_[i] = setup_.kind_of(i);
      if (kinds_[i] == kNoRow) continue;
      if (domain_ != nullptr) {
        const ContactKey key = setup_.key(i);
        const bool is_of_world = key.b == kWorld;
        if (!domain_->is_mine(key.a) && (is_of_world || !domain_->is_mine(key.b))) {
          kinds_[i] = kNoRow;  // a joint of bodies of another rank
          continue;
        }
        if (!is_of_world && domain_->crosses(key.a, key.b)) {
          const std::lock_guard lock(mutex);
          crossing_contacts_.push_back(i);
        }
      }
      const std::uint32_t color = setup_.color_of(i);
      if (!is_color(color)) {
        if (listed_count == listed.size()) flush();
        listed[listed_count++] = {setup_.movable_body(setup_.key(i)), i, 0, 0, kinds_[i]};
        continue;
      }
      std::uint32_t& end = is_of_block(color) ? ends.inner : ends.crossing;
      end = std::max(end, number_in_class(color) + 1);
    }
    flush();
    return ends;
  };
  const Ends ends =
      parallel_reduce(pool_, count, chunk_size(count, 128, kContactsPerChunk), Ends{}, inspect,
                      [](const Ends& x, const Ends& y) {
                        return Ends{std::max(x.inner, y.inner), std::max(x.crossing, y.crossing)};
                      });
  if (has_blocks_) {
    shape_ = {blocks_.size(), ends.inner, ends.crossing, blocks_.size()};
  } else {
    const auto parts = [this](unsigned bits) { return (count_bodies() >> bits) + 1; };
    shape_ = {parts(part_bits_), 0, ends.crossing, parts(kFixedPartBits)};
  }
}

/// Adds the bodies of a row of two ranks.
void SoftStepSolver::add_to_border(Border* border, const ContactKey& key) const {
  const bool is_a_mine = domain_->is_mine(key.a);
  const std::uint32_t mine = is_a_mine ? key.a : key.b, foreign = is_a_mine ? key.b : key.a;
  const Domain::Rank rank = domain_->owner(foreign);
  border->mine.add(rank, mine);
  border->foreign.add(rank, foreign);
}

/// Lists the bodies of the rows that connect bodies of two ranks, in the order of the contacts,
/// which is the same on both ranks.
void SoftStepSolver::find_borders() {
  std::ranges::sort(crossing_contacts_);
  borders_.resize(kColorsPerClass);
  joint_borders_.resize(kColorsPerClass);
  for (Border& border : borders_) border.clear(domain_->ranks());
  for (Border& border : joint_borders_) border.clear(domain_->ranks());
  struct Colors {
    std::uint64_t all = 0, of_joints = 0;
    std::uint64_t has_overflow = 0;
  } colors;
  for (const std::uint32_t contact : crossing_contacts_) {
    const std::uint32_t color = setup_.color_of(contact);
    if (!is_color(color)) continue;
    const std::uint32_t number = number_in_class(color);
    add_to_border(&borders_[number], setup_.key(contact));
    colors.all |= std::uint64_t{1} << number;
    if (!setup_.is_joint(contact)) continue;
    add_to_border(&joint_borders_[number], setup_.key(contact));
    colors.of_joints |= std::uint64_t{1} << number;
  }
  colors.has_overflow = overflow_.empty() ? 0 : 1;
  border_colors_ = joint_border_colors_ = 0;
  any_overflow_ = false;
  for (const Colors& c : domain_->gather(colors)) {
    border_colors_ |= c.all;
    joint_border_colors_ |= c.of_joints;
    any_overflow_ |= c.has_overflow != 0;
  }
  stray_.clear();
  if (any_overflow_) find_overflow_border();
}

/// The same for the overflow, which rank 0 solves. Each body is once in the lists.
void SoftStepSolver::find_overflow_border() {
  overflow_border_.clear(domain_->ranks());
  std::map<std::uint32_t, std::size_t> counts;
  for (const ListedContact& listed : overflow_) {
    const ContactKey key = setup_.key(listed.contact);
    ++counts[key.a];
    ++counts[key.b];
  }
  for (const ListedContact& listed : overflow_) {
    const ContactKey key = setup_.key(listed.contact);
    if (domain_->owner(key.a) != 0 && domain_->owner(key.b) != 0) {
      stray_.push_back(counts[key.a] >= counts[key.b] ? key.a : key.b);
    } else if (domain_->crosses(key.a, key.b)) {
      add_to_border(&overflow_border_, key);
    }
  }
  overflow_border_.mine.sort();
  overflow_border_.foreign.sort();
  // Only rank 0 receives bodies before a sweep of the overflow.
  (domain_->rank() == 0 ? overflow_border_.mine : overflow_border_.foreign).clear(domain_->ranks());
}

/// Sends the impulses of the overflow from rank 0 to the other ranks of its contacts.
void SoftStepSolver::store_overflow() {
  const std::span<Communicator::Message> messages = domain_->start_messages();
  const auto for_crossing = [&](const auto& f) {
    for (const ListedContact& listed : overflow_) {
      const ContactKey key = setup_.key(listed.contact);
      if (domain_->crosses(key.a, key.b)) f(listed.contact, domain_->other_rank(key.a, key.b));
    }
  };
  const auto impulses_of = [&](std::uint32_t contact) {
    return std::span(setup_.contacts.impulses + setup_.contacts.first_impulse(contact),
                     setup_.contacts.impulse_count(contact));
  };
  const auto joint_of = [&](std::uint32_t contact) {
    return std::span(&setup_.joints.now[contact - setup_.contacts.size()], 1);
  };
  if (domain_->rank() == 0) {
    for_crossing([&](std::uint32_t contact, Domain::Rank rank) {
      Communicator::Message* const message = &messages[rank];
      if (setup_.is_joint(contact)) {
        return append_items(message, std::span<const KeptJoint>(joint_of(contact)));
      }
      append_items(message, std::span<const KeptImpulse>(impulses_of(contact)));
      if (setup_.contacts.rolling_impulses == nullptr) return;
      append_items(message, std::span<const Vec3>(setup_.contacts.rolling_impulses + contact, 1));
    });
  }
  const std::span<const Communicator::Message> received = domain_->send();
  if (domain_->rank() == 0) return;
  MessageReader reader(received[0]);
  for_crossing([&](std::uint32_t contact, Domain::Rank) {
    if (setup_.is_joint(contact)) {
      joint_of(contact)[0] = reader.get<KeptJoint>();
      return;
    }
    for (KeptImpulse& impulse : impulses_of(contact)) impulse = reader.get<KeptImpulse>();
    if (setup_.contacts.rolling_impulses == nullptr) return;
    setup_.contacts.rolling_impulses[contact] = reader.get<Vec3>();
  });
}

/// Whether any rank has rows of a color that connect bodies of two ranks.
bool SoftStepSolver::exchanges(std::size_t color, Sweep sweep) const {
  return ((is_of_joints(sweep) ? joint_border_colors_ : border_colors_) >> color & 1) != 0;
}

/// Sends the bodies of this rank in the rows of a color, and receives the other bodies of the rows.
void SoftStepSolver::exchange(std::size_t color, Sweep sweep) {
  const Border& border = (is_of_joints(sweep) ? joint_borders_ : borders_)[color];
  domain_->exchange(
      border.mine, border.foreign, [this](std::uint32_t body) { return bodies_[body]; },
      [this](std::uint32_t body, const SolverBody& state) { bodies_[body] = state; });
}

/// Finds the contacts of each body a in a list that is sorted by key.
template <class Contact>
void SoftStepSolver::find_ranges(const Contact* contacts, std::uint32_t count,
                                 std::vector<std::uint32_t>* ranges) {
  if (count == 0) {
    ranges->clear();
    return;
  }
  resize_geometric(ranges, bodies_.size() + 1);
  std::vector<std::uint32_t>& begin = *ranges;
  parallel_for(pool_, count, kContactsPerChunk, [&](std::size_t first, std::size_t last) {
    for (auto i = static_cast<std::uint32_t>(first); i < last; ++i) {
      const std::uint32_t a = contacts[i].key.a;
      const std::uint32_t next = i == 0 ? 0 : contacts[i - 1].key.a + 1;
      for (std::uint32_t body = next; body <= a; ++body) begin[body] = i;
    }
  });
  const std::uint32_t next = contacts[count - 1].key.a + 1;
  std::fill(begin.begin() + next, begin.end(), count);
}

/// Sorts the joints of two movable bodies by part.
void SoftStepSolver::list_joints() {
  joints_.clear();
  const std::uint32_t first = setup_.contacts.size();
  for (std::uint32_t i = first; i < setup_.size(); ++i) {
    if (kinds_[i] == kNoRow || !is_color(setup_.color_of(i))) continue;
    joints_.push_back({part_of(setup_.key(i).a), i});
  }
  if (!std::ranges::is_sorted(joints_)) std::ranges::sort(joints_);
}

/// The part of a movable body. It is not lower than those of bodies with lower indices, in a world
/// of one block.
std::uint32_t SoftStepSolver::part_of(std::uint32_t body) const {
  return has_blocks_ ? blocks_.block(body) : number_of(body) >> part_bits_;
}

/// Part of the contacts of a movable body with fixed bodies.
std::uint32_t SoftStepSolver::fixed_part_of(std::uint32_t body) const {
  return has_blocks_ ? blocks_.block(body) : number_of(body) >> kFixedPartBits;
}

/// Divides the listed contacts into the overflow, and those with fixed bodies by part.
void SoftStepSolver::group_fixed() {
  const auto is_overflow = [this](const ListedContact& listed) {
    return setup_.color_of(listed.contact) == kOverflowColor;
  };
  overflow_.clear();
  assign_geometric(&fixed_begin_, shape_.fixed_parts + 2, 0);
  std::uint32_t count = 0;
  for (const ListedContact& listed : listed_) {
    if (is_overflow(listed)) {
      overflow_.push_back(listed);
    } else {
      ++fixed_begin_[fixed_part_of(listed.body) + 2];
      ++count;
    }
  }
  std::partial_sum(fixed_begin_.begin(), fixed_begin_.end(), fixed_begin_.begin());
  resize_geometric(&fixed_, count);
  for (const ListedContact& listed : listed_) {
    if (!is_overflow(listed)) fixed_[fixed_begin_[fixed_part_of(listed.body) + 1]++] = listed;
  }
  std::ranges::sort(overflow_, [](const ListedContact& x, const ListedContact& y) {
    return std::tie(x.kind, x.contact) < std::tie(y.kind, y.contact);
  });
}

/// Prefetches the first contacts of spheres of a body. The bodies of a block are scattered, so the
/// hardware does not predict them.
void SoftStepSolver::prefetch_contacts(std::uint32_t body) const {
  if (first_sphere_.empty()) return;
  const std::uint32_t first = first_sphere_[body];
  const SphereContactInput* contact = setup_.contacts.spheres + first;
  const KeptImpulse* impulse = setup_.contacts.impulses + first;
  for (int k = 0; k < 3; ++k) prefetch(contact + k);
  prefetch(impulse);
  prefetch(impulse + 2);
}

/// Calls f(contact, color) for the contacts of the inner and crossing rows of a part.
template <class F>
void SoftStepSolver::for_contacts(std::size_t part, const F& f) const {
  const auto visit = [&](std::uint32_t contact) {
    if (kinds_[contact] == kNoRow) return;
    const std::uint32_t color = setup_.color_of(contact);
    if (is_color(color)) f(contact, color);
  };
  const std::uint32_t spheres = setup_.contacts.sphere_count;
  const auto number = static_cast<std::uint32_t>(part);
  if (has_blocks_) {
    const auto visit_contacts = [&](std::uint32_t body) {
      if (!first_sphere_.empty()) {
        for (std::uint32_t i = first_sphere_[body]; i < first_sphere_[body + 1]; ++i) visit(i);
      }
      if (!first_manifold_.empty()) {
        for (std::uint32_t i = first_manifold_[body]; i < first_manifold_[body + 1]; ++i) {
          visit(spheres + i);
        }
      }
    };
    blocks_.for_bodies(part, visit_contacts,
                       [this](std::uint32_t body) { prefetch_contacts(body); });
  } else {
    // Contacts are sorted by key.
    const auto visit_range = [&](const auto* contacts, std::uint32_t count, std::uint32_t before) {
      const auto* contact = std::lower_bound(
          contacts, contacts + count, number,
          [this](const auto& c, std::uint32_t other) { return part_of(c.key.a) < other; });
      for (; contact != contacts + count && part_of(contact->key.a) == number; ++contact) {
        visit(before + static_cast<std::uint32_t>(contact - contacts));
      }
    };
    visit_range(setup_.contacts.spheres, spheres, 0);
    visit_range(setup_.contacts.manifolds, setup_.contacts.manifold_count, spheres);
  }
  for (auto joint = std::ranges::lower_bound(joints_, PartJoint{number, 0});
       joint != joints_.end() && joint->part == number; ++joint) {
    visit(joint->contact);
  }
}

/// The rows of a part, by kind.
struct SoftStepSolver::Cursors {
  struct Kind {
    std::array<Place, kColorsPerClass> inner, crossing;
    Place fixed;

    Place* at(bool is_of_block, std::uint32_t color) {
      return &(is_of_block ? inner : crossing)[number_in_class(color)];
    }
  };
  std::array<Kind, kRowKinds> kinds;
};

/// Chunk size of a loop over rows.
template <class Row>
std::size_t SoftStepSolver::row_chunk(std::size_t rows) {
  if constexpr (kHasBundles<Row>) return cpu::kBundle * bundle_chunk(rows / cpu::kBundle);
  return chunk_size(rows, 64, kContactsPerChunk);
}

/// Adds the row of a contact to a count.
void SoftStepSolver::count(std::uint32_t contact, Place* place) const {
  ++place->row;
  if (!setup_.is_joint(contact)) place->point += setup_.contacts.impulse_count(contact);
}

/// Counts the rows of a part, and their points.
void SoftStepSolver::count_rows(std::size_t part) {
  Cursors counts{};
  for_contacts(part, [&](std::uint32_t contact, std::uint32_t color) {
    count(contact, counts.kinds[kinds_[contact]].at(is_of_block(color), color));
  });
  for_all_kinds([&]<class Row>(Rows<Row>* rows) {
    const Cursors::Kind& kind = counts.kinds[kKindOf<Row>];
    for (std::size_t c = 0; c < shape_.inner_colors; ++c) {
      rows->set_size(rows->table.inner(part, c), kind.inner[c]);
    }
    for (std::size_t c = 0; c < shape_.crossing_colors; ++c) {
      rows->set_size(rows->table.crossing(part, c), kind.crossing[c]);
    }
  });
}

void SoftStepSolver::count_fixed_rows(std::size_t part) {
  Cursors counts{};
  for (const ListedContact& fixed : fixed_of(part)) {
    count(fixed.contact, &counts.kinds[fixed.kind].fixed);
  }
  for_all_kinds([&]<class Row>(Rows<Row>* rows) {
    rows->set_size(rows->table.fixed(part), counts.kinds[kKindOf<Row>].fixed);
  });
}

/// Assigns the rows of a part to their contacts, and builds them.
void SoftStepSolver::place_rows(std::size_t part) {
  Cursors next;
  for_all_kinds([&]<class Row>(Rows<Row>* rows) {
    Cursors::Kind& kind = next.kinds[kKindOf<Row>];
    for (std::size_t c = 0; c < shape_.inner_colors; ++c) {
      kind.inner[c] = rows->begin(rows->table.inner(part, c));
    }
    for (std::size_t c = 0; c < shape_.crossing_colors; ++c) {
      kind.crossing[c] = rows->begin(rows->table.crossing(part, c));
    }
  });
  for_contacts(part, [&](std::uint32_t contact, std::uint32_t color) {
    Cursors::Kind& kind = next.kinds[kinds_[contact]];
    fill<false>(kinds_[contact], contact, kind.at(is_of_block(color), color));
  });
}

/// place_rows() for rows with fixed bodies. Sorts them by rank, so that consecutive rows have
/// different movable bodies.
void SoftStepSolver::place_fixed_rows(std::size_t part) {
  Cursors next;
  for_all_kinds([&]<class Row>(Rows<Row>* rows) {
    next.kinds[kKindOf<Row>].fixed = rows->begin(rows->table.fixed(part));
  });
  const std::span<ListedContact> fixed = fixed_of(part);
  std::ranges::sort(fixed, [this](const ListedContact& x, const ListedContact& y) {
    return x.body != y.body ? x.body < y.body
                            : setup_.fixed_order(x.contact) < setup_.fixed_order(y.contact);
  });
  for (std::size_t i = 0; i < fixed.size(); ++i) {
    const bool is_next = i > 0 && fixed[i].body == fixed[i - 1].body;
    fixed[i].rank = is_next ? fixed[i - 1].rank + 1 : 0;
  }
  std::ranges::sort(fixed, [](const ListedContact& x, const ListedContact& y) {
    return std::tie(x.rank, x.kind, x.body) < std::tie(y.rank, y.kind, y.body);
  });
  for (ListedContact& listed : fixed) {
    listed.row = fill<true>(listed.kind, listed.contact, &next.kinds[listed.kind].fixed);
  }
}

/// Builds the row of a contact. With vectors, rows of manifolds are only started: see
/// complete_manifolds(). @param place of the row; receives that of the next one
/// @returns the number of the row
template <bool kFixed>
std::uint32_t SoftStepSolver::fill(RowKind kind, std::uint32_t contact, Place* place) {
  const std::uint32_t number = place->row;
  visit_row(kind, [&]<class Row>(std::type_identity<Row>) {
    Rows<Row>& all = rows<Row>();
    Row& row = all.rows[number];
    if constexpr (kHasParts<Row>) row.first = place->point;
    all.contacts[number] = contact;
    if constexpr (std::is_same_v<Row, ManifoldRow>) {
      if (uses_avx2_) {
        setup_.start_row(&row, all.parts_of(row), contact);
      } else {
        setup_.fill<kFixed>(&row, all.parts_of(row), contact);
      }
      if (any_rebounds(row, all.parts_of(row))) any_rebound_.store(true, std::memory_order_relaxed);
    } else {
      setup_.fill<kFixed>(&row, all.parts_of(row), contact);
    }
  });
  count(contact, place);
  return number;
}

void SoftStepSolver::build(const RowSetup& setup, std::span<SolverBody> bodies,
                           std::span<const std::uint32_t> mobile,
                           std::span<const std::uint32_t> places, bool has_blocks,
                           const ImpactBodies& impacts, const StepConstants& constants,
                           Domain* domain) {
  setup_ = setup;
  domain_ = domain;
  impacts_ = impacts;
  constants_ = constants;
  bodies_ = bodies;
  has_blocks_ = has_blocks;
  is_packed_ = false;
  any_rebound_.store(false, std::memory_order_relaxed);
  phases_.reserve(kColorsPerClass + 2);
  part_bits_ = static_cast<unsigned>(std::bit_width(chunk_size(count_bodies(), 32, 128)) - 1);
  if (has_blocks) blocks_.build(mobile, bodies, places, pool_);
  inspect_contacts();
  if (has_blocks) {
    find_ranges(setup_.contacts.spheres, setup_.contacts.sphere_count, &first_sphere_);
    find_ranges(setup_.contacts.manifolds, setup_.contacts.manifold_count, &first_manifold_);
  }
  list_joints();
  group_fixed();
  if (domain_ != nullptr) find_borders();
  allocate_rows();
  for_parts(shape_.parts, [this](std::size_t part) { place_rows(part); });
  for_parts(shape_.fixed_parts, [this](std::size_t part) { place_fixed_rows(part); });
  place_overflow();
  complete_manifolds();
  pack_frames();
}

/// Counts the rows, and reserves memory for them.
void SoftStepSolver::allocate_rows() {
  for_all_kinds([&](auto* rows) { rows->start(shape_); });
  for_parts(shape_.parts, [this](std::size_t part) { count_rows(part); });
  for_parts(shape_.fixed_parts, [this](std::size_t part) { count_fixed_rows(part); });
  for_all_kinds([&]<class Row>(Rows<Row>* rows) {
    Place overflow;
    for (const ListedContact& listed : overflow_) {
      if (listed.kind == kKindOf<Row>) count(listed.contact, &overflow);
    }
    rows->set_size(rows->table.overflow(), overflow);
    rows->table.scan();
    rows->rows.reserve_geometric(rows->table.size(), "rows of contacts");
    rows->contacts.reserve_geometric(rows->table.size(), "rows of contacts");
    if constexpr (kHasParts<Row>) {
      rows->part_table.scan();
      rows->parts.reserve_geometric(rows->part_table.size(), "points of contacts");
    }
    if constexpr (kHasBundles<Row>) {
      rows->table.for_gaps([&](std::uint32_t number) { mark_unused(&rows->rows[number]); });
    }
  });
}

cpu::ManifoldSetup SoftStepSolver::manifold_setup() {
  Rows<ManifoldRow>& all = rows<ManifoldRow>();
  return {.rows = reinterpret_cast<Real*>(all.rows.data()),
          .points = reinterpret_cast<Real*>(all.parts.data()),
          .bundles = {bundle_numbers_.data(), bundle_rows_.data(), bundle_points_.data(),
                      bundle_shares_.data(), first_point_.data()},
          .bodies = reinterpret_cast<const Real*>(bodies_.data()),
          .inverse_inertia = reinterpret_cast<const Real*>(setup_.properties.inverse_inertia),
          .inverse_friction_gap = setup_.inverse_friction_gap,
          .least_weight = kLeastWeight,
          .least_determinant = kLeastDeterminant,
          .epsilon = kEpsilon,
          .released = KeptImpulse::kReleased};
}

/// Calls f(is_fixed, first, last) for parts of the bundles [first, last): those of rows with and
/// without fixed bodies.
template <class F>
void SoftStepSolver::for_fixed_and_others(const RowTable& table, std::size_t first,
                                          std::size_t last, const F& f) {
  const std::size_t fixed = table.begin(table.fixed(0)) / cpu::kBundle;
  const std::size_t overflow = table.begin(table.overflow()) / cpu::kBundle;
  const auto call = [&](bool is_fixed, std::size_t begin, std::size_t end) {
    if (begin < end) f(is_fixed, begin, end);
  };
  call(false, first, std::min(last, fixed));
  call(true, std::max(first, fixed), std::min(last, overflow));
  call(false, std::max(first, overflow), last);
}

/// Completes the rows of manifolds, and writes their bundles.
void SoftStepSolver::complete_manifolds() {
#if defined(__x86_64__)
  if (!uses_avx2_) return;
  const RowTable& table = rows<ManifoldRow>().table;
  const std::size_t bundles = table.size() / cpu::kBundle;
  resize_geometric(&first_point_, bundles + 1);
  const ManifoldRow* const all = rows<ManifoldRow>().rows.data();
  parallel_for(pool_, bundles, bundle_chunk(bundles), [&](std::size_t first, std::size_t last) {
    for (; first < last; ++first) {
      std::uint32_t most = 0;
      for (std::size_t k = 0; k < cpu::kBundle; ++k) {
        most = std::max(most, all[first * cpu::kBundle + k].count);
      }
      first_point_[first] = most;
    }
  });
  first_point_[bundles] = 0;
  std::exclusive_scan(first_point_.begin(), first_point_.end(), first_point_.begin(), 0u);
  constexpr const char* kWhat = "rows of contacts";
  bundle_numbers_.reserve_geometric(bundles, kWhat);
  bundle_rows_.reserve_geometric(bundles * (cpu::bundle_vector::kCount * cpu::kBundle), kWhat);
  bundle_points_.reserve_geometric(
      std::size_t{first_point_[bundles]} * (cpu::bundle_point::kCount * cpu::kBundle), kWhat);
  bundle_shares_.reserve_geometric(
      std::size_t{first_point_[bundles]} * (cpu::bundle_share::kCount * cpu::kBundle), kWhat);
  const cpu::ManifoldSetup setup = manifold_setup();
  parallel_for(pool_, bundles, bundle_chunk(bundles), [&](std::size_t first, std::size_t last) {
    for_fixed_and_others(table, first, last,
                         [&](bool is_fixed, std::size_t begin, std::size_t end) {
                           cpu::kAvx2ManifoldSweep[is_fixed ? 1 : 0].complete(setup, begin, end);
                         });
  });
  is_packed_ = true;
#endif
}

/// Writes the impulses of bundles to the rows [first, last).
/// @param first multiple of kBundle
void SoftStepSolver::unpack([[maybe_unused]] Rows<ManifoldRow>* rows,
                            [[maybe_unused]] std::size_t first, [[maybe_unused]] std::size_t last) {
#if defined(__x86_64__)
  if (!is_packed_) return;
  cpu::kAvx2UnpackManifolds(manifold_setup(), first / cpu::kBundle, last / cpu::kBundle);
#endif
}

/// Writes the impulses of all bundles of manifolds to the rows.
void SoftStepSolver::unpack_manifolds() {
  Rows<ManifoldRow>& all = rows<ManifoldRow>();
  parallel_for(pool_, all.table.size(), row_chunk<ManifoldRow>(all.table.size()),
               [&](std::size_t first, std::size_t last) { unpack(&all, first, last); });
  is_packed_ = false;
}

/// Writes a bundle of joints with frames.
void SoftStepSolver::pack_bundle(const cpu::FrameSweep& sweep, std::size_t bundle) {
  const std::size_t begin = bundle * cpu::kBundle;
  const auto for_lanes = [&](const auto& f) {
    for (std::size_t i = begin; i < begin + cpu::kBundle; ++i) {
      const bool is_row = is_used(rows<FrameRow>().rows[i]);
      f(frame_lane(sweep, i), rows<FrameRow>().rows[is_row ? i : begin], is_row);
    }
  };
  sweep.numbers[bundle] = {};
  for_lanes(
      [](const FrameLane& lane, const FrameRow& row, bool is_used) { lane.pack(row, is_used); });
  if (sweep.numbers[bundle].has_axes == 0) return;
  for_lanes([this](const FrameLane& lane, const FrameRow& row, bool) {
    lane.pack_axes(row, constants_);
  });
}

/// Writes the bundles of joints with frames.
void SoftStepSolver::pack_frames() {
#if defined(__x86_64__)
  if (!uses_avx2_) return;
  const Rows<FrameRow>& all = rows<FrameRow>();
  const std::size_t bundles = all.table.size() / cpu::kBundle;
  frame_numbers_.reserve_geometric(bundles, "rows of joints");
  frame_bundles_.reserve_geometric(bundles * (cpu::frame_vector::kCount * cpu::kBundle),
                                   "rows of joints");
  const cpu::FrameSweep sweep = frame_sweep();
  parallel_for(pool_, bundles, bundle_chunk(bundles), [&](std::size_t first, std::size_t last) {
    for (std::size_t bundle = first; bundle < last; ++bundle) pack_bundle(sweep, bundle);
    for_fixed_and_others(all.table, first, last,
                         [&](bool is_fixed, std::size_t begin, std::size_t end) {
                           cpu::kAvx2FrameSweep[is_fixed ? 1 : 0].start(sweep, begin, end);
                         });
  });
#endif
}

void SoftStepSolver::unpack([[maybe_unused]] Rows<FrameRow>* rows,
                            [[maybe_unused]] std::size_t first, [[maybe_unused]] std::size_t last) {
#if defined(__x86_64__)
  if (!uses_avx2_) return;
  const cpu::FrameSweep sweep = frame_sweep();
  for (std::size_t i = first; i < last; ++i) {
    FrameRow& row = rows->rows[i];
    if (is_used(row) && has_lane(row.parameters)) frame_lane(sweep, i).unpack_impulses(&row);
  }
#endif
}

void SoftStepSolver::place_overflow() {
  Cursors next;
  for_all_kinds([&]<class Row>(Rows<Row>* rows) {
    next.kinds[kKindOf<Row>].fixed = rows->begin(rows->table.overflow());
  });
  for (ListedContact& listed : overflow_) {
    listed.row = fill<false>(listed.kind, listed.contact, &next.kinds[listed.kind].fixed);
  }
}

/// Calls f(part) for all parts.
template <class F>
void SoftStepSolver::for_parts(std::size_t parts, const F& f) {
  parallel_for(pool_, parts, 1, [&](std::size_t part, std::size_t) { f(part); });
}

/// Calls f(operation) with the operation of a sweep.
template <class F>
void SoftStepSolver::with_operation(Sweep sweep, const F& f) {
  switch (sweep) {
    case Sweep::warm_start:
      return f(WarmStart());
    case Sweep::first_joints:
      return f(Solve<true>{constants_, true});
    case Sweep::joints:
    case Sweep::bias:
      return f(Solve<true>{constants_});
    case Sweep::relax:
      return f(Solve<false>{constants_});
    case Sweep::restitution:
      return f(Restitute());
  }
}

template <class Row, class Operation>
void SoftStepSolver::run_row(Rows<Row>* rows, std::size_t i, const Operation& operation,
                             auto is_fixed) {
  Row& row = rows->rows[i];
  const Mat3* const inertia = setup_.properties.inverse_inertia;
  RowContext<typename Row::Part, ImpactBodies> context{
      {&bodies_[row.a], nullptr, &inertia[row.a], nullptr}, rows->parts_of(row), &impacts_};
  if (Row::kReadsOrientation && row.b == kWorld) {
    context.bodies.b = &world_;
    context.bodies.inertia_b = &world_inertia_;
  } else {
    context.bodies.b = &bodies_[row.b];
    context.bodies.inertia_b = &inertia[row.b];
  }
  if constexpr (Row::kReadsOrientation) {
    const BodyProperties& properties = setup_.properties;
    context.orientations = {&properties.orientation[row.a], &world_orientation_,
                            &properties.start_orientation[row.a], &world_orientation_};
    if (row.b != kWorld) {
      context.orientations.b = &properties.orientation[row.b];
      context.orientations.start_b = &properties.start_orientation[row.b];
    }
  }
  operation.template run<decltype(is_fixed)::value>(&row, context);
}

/// Solves rows in vectors. @returns the number of skipped rows, which are written to `left`
template <class Row, bool kFixed>
std::size_t SoftStepSolver::run_kernel([[maybe_unused]] Sweep sweep,
                                       [[maybe_unused]] std::size_t first,
                                       [[maybe_unused]] std::size_t last,
                                       [[maybe_unused]] std::uint32_t* left) {
#if defined(__x86_64__)
  if constexpr (std::is_same_v<Row, ManifoldRow>) {
    const auto kernel = function_of(cpu::kAvx2ManifoldSweep[kFixed ? 1 : 0], sweep);
    return kernel(manifold_sweep(kFixed), first, last, left);
  } else if constexpr (std::is_same_v<Row, FrameRow>) {
    cpu::FrameSweep frames = frame_sweep();
    frames.starts = sweep == Sweep::first_joints;
    return function_of(cpu::kAvx2FrameSweep[kFixed ? 1 : 0], sweep)(frames, first, last, left);
  } else {
    return function_of(cpu::kAvx2SphereSweep, sweep)(sphere_sweep(), first, last, left);
  }
#else
  return 0;  // not called
#endif
}

/// Solves consecutive rows. The movable bodies of each are different from those of all others.
template <bool kFixed, class Row, class Operation>
void SoftStepSolver::run_rows(Rows<Row>* rows, std::size_t first, std::size_t last, Sweep sweep,
                              const Operation& operation) {
  using IsFixed = std::bool_constant<kFixed>;
  if (!takes_part<Row>(sweep)) return;
  constexpr bool kHasKernel = kHasBundles<Row> || (std::is_same_v<Row, SphereRow> && !kFixed);
  if constexpr (kHasKernel) {
    if (uses_avx2_ && sweep != Sweep::restitution) {
      for (std::size_t begin = first, end = 0; begin < last; begin = end) {
        std::array<std::uint32_t, kRowsPerKernel> skipped;
        end = std::min(last, (begin / kRowsPerKernel + 1) * kRowsPerKernel);
        const std::size_t count = run_kernel<Row, kFixed>(sweep, begin, end, skipped.data());
        for (std::size_t k = 0; k < count; ++k) run_row(rows, skipped[k], operation, IsFixed());
      }
      return;
    }
  }
  for (std::size_t i = first; i < last; ++i) run_row(rows, i, operation, IsFixed());
}

/// Solves the rows with the fixed bodies of a part: runs of the same rank and kind.
template <class Operation>
void SoftStepSolver::sweep_fixed(std::size_t part, Sweep sweep, const Operation& operation) {
  const std::span<const ListedContact> fixed = fixed_of(part);
  for (std::size_t first = 0, last = 0; first < fixed.size(); first = last) {
    const ListedContact& run = fixed[first];
    while (last < fixed.size() && fixed[last].rank == run.rank && fixed[last].kind == run.kind) {
      ++last;
    }
    visit_row(run.kind, [&]<class Row>(std::type_identity<Row>) {
      run_rows<true>(&rows<Row>(), run.row, run.row + (last - first), sweep, operation);
    });
  }
}

template <class Operation>
void SoftStepSolver::sweep_inner(std::size_t block, Sweep sweep, const Operation& operation) {
  for (std::size_t color = 0; color < shape_.inner_colors; ++color) {
    for_all_kinds([&](auto* rows) {
      const std::size_t cell = rows->table.inner(block, color);
      run_rows<false>(rows, rows->table.begin(cell), rows->table.end(cell), sweep, operation);
    });
  }
}

/// Number of chunks of a crossing color.
std::size_t SoftStepSolver::chunks_of_color(std::size_t color, Sweep sweep) const {
  std::size_t cost = 0;
  for_all_kinds([&]<class Row>(const Rows<Row>* rows) {
    if (!takes_part<Row>(sweep)) return;
    const RowTable& table = rows->table;
    cost += kCost<Row> * (table.end(table.crossing(shape_.parts - 1, color)) -
                          table.begin(table.crossing(0, color)));
  });
  if (cost == 0) return 0;
  const std::size_t chunks =
      cost <= kCostOfOneThread ? 1 : (cost + kCostPerChunk - 1) / kCostPerChunk;
  return std::min(chunks, shape_.parts * RowTable::kSlices);
}

/// Solves a chunk of a crossing color. All colors are divided at the same parts, so that a thread
/// has most of the bodies in its cache.
template <class Operation>
void SoftStepSolver::sweep_crossing(std::size_t color, std::size_t chunk, std::size_t chunks,
                                    Sweep sweep, const Operation& operation) {
  const std::size_t slices = shape_.parts * RowTable::kSlices;
  const std::size_t first = slices * chunk / chunks, last = slices * (chunk + 1) / chunks;
  for_all_kinds([&](auto* rows) {
    const RowTable& table = rows->table;
    run_rows<false>(rows, table.crossing_boundary(first, color),
                    table.crossing_boundary(last, color), sweep, operation);
  });
}

/// Consecutive colors with one chunk each are one phase of one thread: a phase takes as long as
/// dozens of rows.
void SoftStepSolver::find_phases(Sweep sweep) {
  phases_.clear();
  if (shape_.inner_colors > 0) phases_.push_back({Phase::inner, 0, 0, shape_.parts});
  const std::size_t colors = domain_ == nullptr ? shape_.crossing_colors : kColorsPerClass;
  for (std::size_t color = 0; color < colors; ++color) {
    const std::size_t chunks = color < shape_.crossing_colors ? chunks_of_color(color, sweep) : 0;
    const bool is_exchanged = domain_ != nullptr && exchanges(color, sweep);
    if (chunks == 0 && !is_exchanged) continue;
    const bool joins = chunks == 1 && !is_exchanged && !phases_.empty() &&
                       phases_.back().kind == Phase::crossing && phases_.back().chunks == 1;
    if (joins) {
      phases_.back().last_color = color;
    } else {
      phases_.push_back({Phase::crossing, color, color, chunks, is_exchanged});
    }
  }
  if (!fixed_.empty()) phases_.push_back({Phase::fixed, 0, 0, shape_.fixed_parts});
}

void SoftStepSolver::sweep_overflow(Sweep sweep) {
  // A rebound also changes FreeMotion.
  struct State {
    SolverBody body;
    FreeMotion free;
  };
  const auto read = [this](std::uint32_t body) {
    return State{bodies_[body], impacts_.free[body]};
  };
  const auto write = [this](std::uint32_t body, const State& state) {
    bodies_[body] = state.body;
    impacts_.free[body] = state.free;
  };
  const Border& border = overflow_border_;
  const bool is_shared = domain_ != nullptr && any_overflow_;
  if (is_shared) domain_->exchange(border.mine, border.foreign, read, write);
  if (!is_shared || domain_->rank() == 0) solve_overflow(sweep);
  if (is_shared) domain_->exchange(border.foreign, border.mine, read, write);
}

void SoftStepSolver::solve_overflow(Sweep sweep) {
  with_operation(sweep, [&](const auto& operation) {
    for (const ListedContact& listed : overflow_) {
      visit_row(listed.kind, [&]<class Row>(std::type_identity<Row>) {
        run_rows<false>(&rows<Row>(), listed.row, listed.row + 1u, sweep, operation);
      });
    }
  });
}

void SoftStepSolver::sweep(Sweep sweep) {
  if (sweep == Sweep::restitution) unpack_manifolds();
  sweep_overflow(sweep);
  find_phases(sweep);
  with_operation(sweep, [&](const auto& operation) {
    const auto run = [&](std::size_t number, std::size_t chunk) {
      const Phase& phase = phases_[number];
      switch (phase.kind) {
        case Phase::inner:
          return sweep_inner(chunk, sweep, operation);
        case Phase::crossing:
          for (std::size_t color = phase.first_color; color <= phase.last_color; ++color) {
            sweep_crossing(color, chunk, phase.chunks, sweep, operation);
          }
          return;
        case Phase::fixed:
          return sweep_fixed(chunk, sweep, operation);
      }
    };
    for (std::size_t first = 0, last = 0; first < phases_.size(); first = last) {
      if (phases_[first].exchanges) exchange(phases_[first].first_color, sweep);
      for (last = first + 1; last < phases_.size() && !phases_[last].exchanges;) ++last;
      if (phases_[first].chunks == 0 && ++first == last) continue;
      pool_->run_phases(
          last - first, [&](std::size_t number) { return phases_[first + number].chunks; },
          [&](std::size_t number, std::size_t chunk) { run(first + number, chunk); });
    }
  });
}

cpu::ManifoldSweep SoftStepSolver::manifold_sweep(bool is_fixed) {
  const StepConstants& c = constants_;
  return {manifold_setup().bundles, reinterpret_cast<Real*>(bodies_.data()), sweep_constants(c),
          softness(is_fixed ? c.fixed : c.movable),
          softness(is_fixed ? c.jointed_fixed : c.jointed)};
}

cpu::SphereSweep SoftStepSolver::sphere_sweep() {
  const StepConstants& c = constants_;
  return {reinterpret_cast<Real*>(rows<SphereRow>().rows.data()),
          reinterpret_cast<Real*>(bodies_.data()),
          sweep_constants(c),
          c.restitution_threshold,
          softness(c.balls),
          softness(c.deep_balls),
          kDeepPenetration};
}

cpu::FrameSweep SoftStepSolver::frame_sweep() {
  const StepConstants& c = constants_;
  const BodyProperties& properties = setup_.properties;
  return {.numbers = frame_numbers_.data(),
          .rows = frame_bundles_.data(),
          .bodies = reinterpret_cast<Real*>(bodies_.data()),
          .orientation = reinterpret_cast<const Real*>(properties.orientation),
          .start_orientation = reinterpret_cast<const Real*>(properties.start_orientation),
          .inverse_inertia = reinterpret_cast<const Real*>(properties.inverse_inertia),
          .h = c.h,
          .inverse_h = c.inverse_h,
          .correction = kJointCorrection,
          .most_correction = most_correction(c),
          .most_turn = kMostTurn,
          .epsilon = kEpsilon,
          .starts = false};
}

/// Keeps the impulses of the rows of a bundle.
void SoftStepSolver::keep_bundle([[maybe_unused]] std::size_t bundle) {
#if defined(__x86_64__)
  const Rows<ManifoldRow>& all = rows<ManifoldRow>();
  const ContactView& contacts = setup_.contacts;
  const cpu::BundleNumbers& numbers = bundle_numbers_[bundle];
  cpu::KeptLanes kept{reinterpret_cast<Real*>(contacts.impulses), {}, {}};
  for (unsigned k = 0; k < cpu::kBundle; ++k) {
    if ((numbers.used >> k & 1) == 0) continue;
    const std::size_t row = bundle * cpu::kBundle + k;
    const std::uint32_t contact = all.contacts[row];
    if ((numbers.rolls >> k & 1) != 0) {
      setup_.store(all.rows[row], &all.parts[all.rows[row].first], contact);
      continue;
    }
    kept.first[k] = contacts.first_impulse(contact);
    kept.side[k] = setup_.side_of(contact);
    if (contacts.rolling_impulses != nullptr) setup_.store_rolling(all.rows[row], contact);
  }
  cpu::kAvx2KeepManifold(manifold_setup(), bundle, kept);
#endif
}

void SoftStepSolver::store(Rows<ManifoldRow>* rows, std::size_t first, std::size_t last) {
  if (is_packed_) {
    for (; first < last; first += cpu::kBundle) keep_bundle(first / cpu::kBundle);
    return;
  }
  for (; first < last; ++first) {
    const ManifoldRow& row = rows->rows[first];
    if (is_used(row)) setup_.store(row, rows->parts_of(row), rows->contacts[first]);
  }
}
void SoftStepSolver::store(Rows<FrameRow>* rows, std::size_t first, std::size_t last) {
  unpack(rows, first, last);
  for (; first < last; ++first) {
    const FrameRow& row = rows->rows[first];
    if (is_used(row)) setup_.store(row, nullptr, rows->contacts[first]);
  }
}
template <class Row>
void SoftStepSolver::store(Rows<Row>* rows, std::size_t first, std::size_t last) {
  for (; first < last; ++first) setup_.store(rows->rows[first], nullptr, rows->contacts[first]);
}

void SoftStepSolver::store() {
  for_all_kinds([this]<class Row>(Rows<Row>* rows) {
    const std::size_t count = rows->table.size();
    parallel_for(pool_, count, row_chunk<Row>(count),
                 [&](std::size_t first, std::size_t last) { store(rows, first, last); });
  });
  if (domain_ != nullptr && any_overflow_) store_overflow();
}

}  // namespace soft_step
}  // namespace JFPX_ABI
}  // namespace jfpx
