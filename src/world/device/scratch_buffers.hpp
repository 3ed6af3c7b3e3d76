/// Temporary device memory of one step.
#pragma once

#include "src/world/bodies/body_store.hpp"
#include "src/world/bodies/partition.hpp"
#include "src/world/device/step_data.hpp"
#include "src/world/device/transfer.hpp"

#include <algorithm>
#include <cstdint>
#include <iterator>

namespace jfpx {
inline namespace JFPX_ABI {
namespace device {

template <class Device>
class ScratchBuffers {
 public:
  /// Reserves the arrays indexed by body. @param n number of slots
  void reserve_bodies(const Transfer<Device>& transfer, std::size_t n, StepData* data) {
    StepData& d = *data;
    d.motion = transfer.room(&motion_, n);
    d.swept_bounds.motion = d.motion;
    d.first_candidate = transfer.room(&first_candidate_, n);
    d.manifold_sizes = transfer.room(&manifold_sizes_, n);
    d.used_colors = transfer.room(&used_colors_, n);
    may_have_blocks_ = n > BodyStore::most_in_one_block;
    if (may_have_blocks_) reserve_blocks(transfer, n, data);
    slots_ = n;
    d.first_order = transfer.room(&first_order_, n);
    d.first_contact = transfer.room(&first_contact_, n);
    d.parent = transfer.room(&parent_, n);
    d.marked = transfer.room(&marked_, n);
    d.constrained = transfer.room(&constrained_, n);
    d.step.constrained = d.constrained;
    d.step.solver = transfer.room(&solver_, n);
    d.step.traits = transfer.room(&traits_, n);
    d.step.orientation = transfer.room(&orientation_, n);
    d.pair_count = transfer.room(&pair_count_, 1);
    d.counters = transfer.room(&counters_, 1);
  }

  /// Orientations during a step, by solver index.
  Quat* orientation_of_step(const StepData& data) {
    return data.step.bodies.has_blocks ? orientation_by_index_.data() : data.step.orientation;
  }

  /// Reserves the arrays indexed by sub-shape.
  void reserve_sub_shapes(const Transfer<Device>& transfer, const SubShapeRanges& ranges,
                          StepData* data) {
    const std::size_t boxes = ranges.fixed_begin() - ranges.spheres();
    const PageLayout layout{.index = ArrayIndex::sub_shape};
    data->swept_bounds.margins = transfer.room_to_grow(&margins_, ranges.bounded(), layout);
    data->swept_bounds.swept = transfer.room_to_grow(&swept_, ranges.bounded(), layout);
    if (transfer.parts() > 1) {  // the first device searches
      data->searched =
          transfer.room_to_grow(&searched_, ranges.bounded(), {.index = ArrayIndex::of_first});
    }
    data->swept_bounds.boxes = transfer.room_to_grow(&boxes_, boxes, kEqual);
  }

  /// Reserves the lists. Sets StepData::capacity.
  void reserve_lists(const Transfer<Device>& transfer, const Capacity& capacity, StepData* data) {
    StepData& d = *data;
    Capacity& c = d.capacity = capacity;
    c.indices = static_cast<std::uint32_t>(
        may_have_blocks_ ? std::max(std::size_t{capacity.indices}, usual_index_count()) : slots_);
    reserve_solver(transfer, c.indices, data);
    const std::size_t contacts = std::size_t{c.spheres} + c.candidates;
    const std::size_t all_rows = contacts + d.world_joints.count;
    const std::size_t rows_of_part =
        d.parts == 1 ? all_rows : std::max<std::size_t>(c.rows, all_rows / d.parts * 9 / 8 + 64);
    const std::size_t rows = d.parts * rows_of_part;
    d.row_capacity = static_cast<std::uint32_t>(rows_of_part);
    const PageLayout by_contact{.index = ArrayIndex::contact}, by_pair{.index = ArrayIndex::pair};
    d.pairs = transfer.room(&pairs_, c.pairs, by_pair);
    d.pair_found = transfer.room(&pair_found_, c.pairs, by_pair);
    d.pair_results = transfer.room(&pair_results_, c.pairs, by_pair);
    const std::size_t candidates = d.parts * std::size_t{d.candidate_capacity()};
    d.candidates = transfer.room(&candidates_, candidates, kEqual);
    d.full_tests = transfer.room(&full_tests_, candidates, kEqual);
    d.hiding = transfer.room(&hiding_, candidates, kEqual);
    d.tested = transfer.room(&tested_, candidates, kEqual);
    d.next_candidate = transfer.room(&next_candidate_, candidates, kEqual);
    d.uncolored = transfer.room(&uncolored_, all_rows, by_contact);
    d.still_uncolored = transfer.room(&still_uncolored_, all_rows, kEqual);
    d.row_of = d.uncolored;
    d.row_places = transfer.room(&row_places_, all_rows, by_contact);
    d.bins = transfer.room(&bins_, kMostParts, kEqual);
    d.row_contact = transfer.room(&row_contact_, rows, kEqual);
    d.next_fixed = transfer.room(&next_fixed_, rows, kEqual);
    d.next_inner_joint = transfer.room(&next_inner_joint_, d.world_joints.count, kEqual);
    d.overflow = transfer.room(&overflow_, all_rows, kEqual);
    d.sphere_rows = {transfer.room(&sphere_rows_, rows,
                                   columns_of<soft_step::SphereRow>(ArrayIndex::equal, rows)),
                     rows};
    if (may_have_blocks_) {
      constexpr soft_step::RowKind kFirst = soft_step::kKindOf<soft_step::SphereRow> + 1;
      std::size_t count = 0;
      for (soft_step::RowKind kind = kFirst; kind < soft_step::kRowKinds; ++kind) {
        count += d.parts * std::size_t{d.capacity_of(kind)};
      }
      std::uint32_t* next = transfer.room(&inner_contacts_, count, kEqual);
      for (soft_step::RowKind kind = kFirst; kind < soft_step::kRowKinds; ++kind) {
        d.inner_contacts[kind] = next;
        next += d.parts * std::size_t{d.capacity_of(kind)};
      }
    }
    d.manifold_rows =
        transfer.room(&manifold_rows_, d.parts * std::size_t{c.manifold_rows}, kEqual);
    d.point_rows = transfer.room(&point_rows_, d.parts * std::size_t{c.row_points}, kEqual);
  }

 private:
  /// Number of solver indices of a world with blocks: the places of all slots, which end with a
  /// block, and the bodies without a place of a world whose partition is not due.
  std::size_t usual_index_count() const {
    return slots_ + kBodiesPerBlock + slots_ / partition::kBodiesPerBodyWithoutPlace;
  }

  static constexpr PageLayout kEqual{.index = ArrayIndex::equal};

  /// Reserves the arrays by solver index. @param n number of indices
  void reserve_solver(const Transfer<Device>& transfer, std::size_t n, StepData* data) {
    StepData& d = *data;
    constexpr ArrayIndex kPlace = ArrayIndex::place;
    const PageLayout layout{.index = kPlace};
    // The velocities are one array of a world with blocks (BodyMotion).
    const PageLayout of_cells{
        .index = kPlace, .columns = CellColumns::kColumns, .first_width = 2, .items = n};
    d.columns = {transfer.room(&cells_, n * CellColumns::kColumns, of_cells), n};
    d.row_bodies = transfer.room(&row_bodies_, n, layout);
    d.balls = transfer.room(&balls_, n, layout);
    d.substep_bodies = {
        transfer.room(&substep_bodies_, n, columns_of<soft_step::SubstepBody>(kPlace, n)), n};
    d.first_fixed = transfer.room(&first_fixed_, n, layout);
    d.codes = codes_in(d.columns.cells, n);
    if (!may_have_blocks_) return;
    d.body_at = transfer.room(&body_at_, n, layout);
    transfer.room(&orientation_by_index_, n, layout);
  }

  /// Layout of a StripedArray of n items.
  template <class T>
  static PageLayout columns_of(ArrayIndex index, std::size_t n) {
    return {.index = index, .columns = StripedArray<T>::kPieces, .items = n};
  }

  /// Reserves the arrays of worlds with several blocks. @param n number of slots
  void reserve_blocks(const Transfer<Device>& transfer, std::size_t n, StepData* data) {
    StepData& d = *data;
    d.solver_index = transfer.room(&solver_index_, n);
    d.unplaced = transfer.room(&unplaced_, n);
    const std::size_t blocks = n / kBodiesPerBlock + 1;
    const PageLayout layout{.index = ArrayIndex::block, .items = blocks};
    d.inner_rows = transfer.room(
        &inner_rows_, blocks * soft_step::kRowKinds * (soft_step::kColorsPerClass + 1u), layout);
    d.first_inner_joint = transfer.room(&first_inner_joint_, blocks, layout);
    d.first_of_block = transfer.room(&first_of_block_, blocks, kEqual);
    d.block_number = transfer.room(&block_number_, blocks, kEqual);
  }

  static SortedCodes codes_in(VectorCells* memory, std::size_t n) {
    SortedCodes codes;
    static_assert(CellColumns::kColumns * sizeof(VectorCells) >=
                  2 * (sizeof(*codes.keys) + sizeof(*codes.items)));
    codes.keys = reinterpret_cast<std::uint64_t*>(memory);
    codes.other_keys = codes.keys + n;
    codes.items = reinterpret_cast<std::uint32_t*>(codes.other_keys + n);
    codes.other_items = codes.items + n;
    return codes;
  }

  template <class T>
  using Buffer = typename Device::template Buffer<T>;

  Buffer<Vec3> motion_;
  Buffer<Real> margins_;
  Buffer<SphereInstance> swept_, searched_;
  Buffer<Aabb> boxes_;
  Buffer<SpherePair> pairs_;
  Buffer<cuda::ContactCount> pair_count_;
  Buffer<NormalDistance> pair_results_;
  Buffer<Candidate> candidates_;
  Buffer<CandidateManifold> tested_;
  Buffer<std::uint32_t> full_tests_, hiding_, first_candidate_, next_candidate_, first_contact_,
      uncolored_, still_uncolored_, parent_, row_contact_, first_fixed_, next_fixed_, overflow_,
      body_at_, solver_index_, unplaced_, inner_rows_, first_inner_joint_, next_inner_joint_,
      inner_contacts_, first_of_block_, block_number_;
  Buffer<RowBins> bins_;
  Buffer<soft_step::UsedColors> used_colors_;
  Buffer<std::uint64_t> manifold_sizes_, first_order_;
  Buffer<std::uint8_t> pair_found_, marked_, constrained_, traits_;
  Buffer<std::uint16_t> row_places_;
  Buffer<soft_step::SolverBody> solver_;
  Buffer<Quat> orientation_, orientation_by_index_;
  Buffer<soft_step::SphereRow> sphere_rows_;
  Buffer<soft_step::ManifoldRow> manifold_rows_;
  Buffer<soft_step::PointRow> point_rows_;
  Buffer<VectorCells> cells_;
  Buffer<RowBody> row_bodies_;
  Buffer<BallProperties> balls_;
  Buffer<soft_step::SubstepBody> substep_bodies_;
  Buffer<Counters> counters_;
  std::size_t slots_ = 0;         ///< number of slots of bodies
  bool may_have_blocks_ = false;  ///< whether the world may get several blocks
};

}  // namespace device
}  // namespace JFPX_ABI
}  // namespace jfpx
