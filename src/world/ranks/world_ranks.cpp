/// Owners and ghosts of a world with several ranks; see the header.
#include "src/world/ranks/world_ranks.hpp"

#include "src/base/parallel_for.hpp"
#include "src/base/spin_lock.hpp"
#include "src/world/bodies/partition.hpp"

#include <algorithm>
#include <array>
#include <functional>
#include <mutex>
#include <numeric>
#include <utility>

namespace jfpx {
inline namespace JFPX_ABI {
namespace {

using BodyMotion = MotionColumns<ValueColumn>;
static_assert(std::is_trivially_copyable_v<BodyMotion>);

/// Number of bodies whose bounds are one box for other ranks.
constexpr std::size_t kBodiesPerGroup = 16;
/// Number of bodies near other ranks that look for boxes together.
constexpr std::size_t kBodiesPerBorderGroup = 8;
constexpr std::size_t kGroupsPerChunk = 8;
/// Least slack of the bounds within which ghosts are kept, in mean extents of the bodies.
constexpr Real kSlack = Real(0.15);
/// Steps after which the bodies get new owners, so that the domains remain compact.
constexpr std::uint64_t kStepsPerAssignment = 64;
/// Steps after which they may get new owners because the loads have changed.
constexpr std::uint32_t kStepsPerBalance = 8;
/// Time of a step in rows of spheres: of a body, and of a contact of other shapes.
constexpr unsigned kRowsOfBody = 2, kRowsOfManifold = 4;

BodyMotion motion_of(const MotionArrays& moving, std::uint32_t body) {
  BodyMotion motion;
  each_motion([body](auto& value, const auto& column) { value = column[body]; }, motion, moving);
  return motion;
}
void set_motion(MotionArrays* moving, std::uint32_t body, const BodyMotion& motion) {
  each_motion([body](const auto& value, auto& column) { column[body] = value; }, motion, *moving);
}

/// Bounds of the motion of a body in a step: a box around a ball that encloses SweptBounds::swept
/// of its sub-shapes.
Aabb swept_box(const BodyView& bodies, std::uint32_t i, Real margin) {
  // The bounds of a part of a compound may reach beyond the extent of the body.
  const Real extent = bodies.radius[i] > 0 ? bodies.radius[i] : 2 * bodies.extent[i];
  const Real turned = length(bodies.turning(i)) * bodies.dt;
  const Vec3 half_motion = bodies.predicted_motion(i) * Real(0.5);
  const Vec3 at = bodies.position[i] + half_motion;
  constexpr Real kRounding = 1 + 64 * kEpsilon;
  const Real turn = bodies.radius[i] > 0 ? Real(0) : std::min(turned, Real(2));
  Real reach = (extent * (1 + turn) + length(half_motion) + margin) * kRounding;
  reach += 64 * kEpsilon * (absolute(at.x) + absolute(at.y) + absolute(at.z));
  const Vec3 half{reach, reach, reach};
  return {at - half, at + half};
}

/// A box for ForeignBoxes, whose tree has finite boxes. Bodies beyond the limits end the step.
Aabb enlarged(const Aabb& box, Real by) {
  constexpr Real kEnd = TreeBlock::kFar / 2;
  const auto limited = [](Real x, Real otherwise) { return x > -kEnd && x < kEnd ? x : otherwise; };
  Aabb result;
  for (int axis = 0; axis < 3; ++axis) {
    result.lower[axis] = limited(box.lower[axis] - by, -kEnd);
    result.upper[axis] = limited(box.upper[axis] + by, kEnd);
  }
  return result;
}

/// Morton curve that first divides the axis along which bodies with consecutive slots are closest
/// to each other, so that most bodies of a rank are next to each other in memory.
class DomainCurve {
 public:
  /// @param bodies ascending
  DomainCurve(const std::vector<Vec3>& positions, std::span<const std::uint32_t> bodies)
      : grid_(grid_of(positions, bodies)) {
    std::array<double, 3> distance{};
    for (std::size_t k = 1; k < bodies.size(); ++k) {
      const Vec3 d = positions[bodies[k]] - positions[bodies[k - 1]];
      for (int axis = 0; axis < 3; ++axis) {
        distance[static_cast<std::size_t>(axis)] += static_cast<double>(absolute(d[axis]));
      }
    }
    std::ranges::sort(axes_, std::greater<>(),
                      [&](int axis) { return distance[static_cast<std::size_t>(axis)]; });
  }
  std::uint64_t code(const Vec3& position) const {
    return grid_.code({position[axes_[0]], position[axes_[1]], position[axes_[2]]});
  }

 private:
  static partition::Grid grid_of(const std::vector<Vec3>& positions,
                                 std::span<const std::uint32_t> bodies) {
    partition::Magnitude largest = 0;
    for (const std::uint32_t body : bodies) {
      largest = std::max(largest, partition::magnitude_of(positions[body]));
    }
    return partition::Grid(largest);
  }

  partition::Grid grid_;
  std::array<int, 3> axes_{0, 1, 2};  ///< the last one is divided first
};

/// Also false if a number is NaN.
bool contains(const Aabb& outer, const Aabb& inner) {
  return outer.lower.x <= inner.lower.x && inner.upper.x <= outer.upper.x &&
         outer.lower.y <= inner.lower.y && inner.upper.y <= outer.upper.y &&
         outer.lower.z <= inner.lower.z && inner.upper.z <= outer.upper.z;
}

/// Number of rows of each body in the last step, by index: those of contacts that the rank of the
/// body has detected.
std::vector<std::uint8_t> count_rows(const BodyStore& bodies, const soft_step::ContactSet& last) {
  constexpr unsigned kMostRows = 255;
  std::vector<std::uint8_t> rows(bodies.capacity(), 0);
  const auto count = [&](const auto& contacts, unsigned of_contact) {
    for (const auto& contact : contacts) {
      const std::uint32_t body = bodies.movable(contact.key.a) ? contact.key.a : contact.key.b;
      rows[body] = static_cast<std::uint8_t>(std::min(rows[body] + of_contact, kMostRows));
    }
  };
  count(last.spheres, 1);
  count(last.manifolds, kRowsOfManifold);
  return rows;
}

}  // namespace

void ForeignBoxes::receive(std::span<const Communicator::Message> messages) {
  boxes_.clear();
  ranks_.clear();
  for (std::size_t r = 0; r < messages.size(); ++r) {
    for (MessageReader reader(messages[r]); !reader.at_end();) {
      boxes_.push_back(reader.get<Aabb>());
      ranks_.push_back(static_cast<Domain::Rank>(r));
    }
  }
  items_.resize(boxes_.size());
  std::iota(items_.begin(), items_.end(), 0u);
  tree_.build(boxes_, items_);
}

void WorldRanks::collect(BodyStore* bodies) {
  if (motion_is_complete_) return;
  MotionArrays* const moving = &bodies->moving;
  domain_.share([&](std::uint32_t i) { return motion_of(*moving, i); },
                [&](std::uint32_t i, const BodyMotion& motion) { set_motion(moving, i, motion); });
  motion_is_complete_ = true;
}

/// Fetches of all bodies what determines their owners and blocks.
/// @param rows number of rows, by body; receives that of the bodies of other ranks
void WorldRanks::share_positions(BodyStore* bodies, std::span<std::uint8_t> rows) {
  struct Item {
    Vec3 position;
    std::uint8_t awake, rows;
  };
  MotionArrays& moving = bodies->moving;
  domain_.share(
      [&](std::uint32_t i) {
        return Item{moving.position[i], moving.awake[i], rows[i]};
      },
      [&](std::uint32_t i, const Item& item) {
        moving.position[i] = item.position;
        moving.awake[i] = item.awake;
        rows[i] = item.rows;
      });
}

/// Sends the motion of bodies from their former owners to the new ones.
void WorldRanks::migrate_motion(std::span<const Domain::Rank> before, BodyStore* bodies,
                                DetectedContacts* detected) {
  BodyLists sent, received;
  sent.clear(domain_.ranks());
  received.clear(domain_.ranks());
  for (std::uint32_t body = 0; body < before.size(); ++body) {
    const Domain::Rank from = before[body], to = domain_.owner(body);
    if (from == to || from == Domain::kEveryRank || to == Domain::kEveryRank) continue;
    if (from == domain_.rank()) sent.add(to, body);
    if (to == domain_.rank()) received.add(from, body);
  }
  struct Item {
    BodyMotion motion;
    Vec3 position, velocity, angular_velocity;  ///< DetectedContacts
  };
  const auto columns = {std::pair(&Item::position, &detected->position),
                        std::pair(&Item::velocity, &detected->velocity),
                        std::pair(&Item::angular_velocity, &detected->angular_velocity)};
  domain_.exchange(
      sent, received,
      [&](std::uint32_t i) {
        Item item{motion_of(bodies->moving, i), {}, {}, {}};
        for (const auto& [member, column] : columns) {
          if (i < column->size()) item.*member = (*column)[i];
        }
        return item;
      },
      [&](std::uint32_t i, const Item& item) {
        set_motion(&bodies->moving, i, item.motion);
        for (const auto& [member, column] : columns) {
          if (i < column->size()) (*column)[i] = item.*member;
        }
      });
}

void WorldRanks::gather_joints(JointStore* joints) {
  if (joints_are_complete_) return;
  joints_are_complete_ = true;
  if (joints->empty()) return;
  struct Item {
    std::uint32_t joint;
    soft_step::KeptJoint kept;
  };
  std::vector<Item> items;
  const auto for_joints = [&](const auto& f) {
    for (const JointId id : joints->ids()) {
      const soft_step::JointInput& input = joints->input(id.index);
      const Domain::Rank rank = input.b == soft_step::kWorld ? domain_.owner(input.a)
                                                             : domain_.detector(input.a, input.b);
      f(id.index, rank);
    }
  };
  for_joints([&](std::uint32_t joint, Domain::Rank rank) {
    if (rank == domain_.rank()) items.push_back({joint, joints->kept(joint)});
  });
  Communicator::Message message;
  append_list(&message, items);
  for (const Communicator::Message& received : domain_.send_to_all(message)) {
    if (received.empty()) continue;
    items.clear();
    MessageReader(received).append_to(&items);
    for (const Item& item : items) joints->last()[item.joint] = item.kept;
  }
}

/// Divides the bodies along a Morton curve, so that the steps of all ranks take about equally long.
/// The bodies of a block have one owner.
/// @param rows number of rows, by body
void WorldRanks::assign_owners(const BodyStore& bodies, std::span<const std::uint8_t> rows) {
  constexpr std::uint32_t kNoBlock = 0xffffffffu;
  const MotionArrays& moving = bodies.moving;
  const auto block_of = [&](std::uint32_t body) {
    const std::uint32_t place = bodies.has_blocks() ? moving.place[body] : soft_step::kNoPlace;
    return place == soft_step::kNoPlace ? kNoBlock : soft_step::block_of(place);
  };
  std::vector<std::uint32_t> movable;
  for (const std::uint32_t i : bodies.mobile()) {
    if (bodies.movable(i)) movable.push_back(i);
  }
  const DomainCurve curve(moving.position, movable);
  std::vector<std::uint8_t> is_pinned(bodies.capacity(), 0);
  for (const std::uint32_t body : pinned_) is_pinned[body] = 1;
  // A block, or a body without a block. Those with pinned bodies belong to rank 0.
  struct Unit {
    std::uint64_t code = ~std::uint64_t{0};  ///< the lowest one of its bodies
    std::uint64_t weight = 0;
    Domain::Rank owner = 0;
    bool is_pinned = false;
  };
  std::vector<Unit> units;
  std::uint64_t total = 0;
  without_place_ = 0;
  const auto add = [&](std::uint32_t body, Unit* unit) {
    constexpr unsigned kAwake = 8;
    const unsigned cost = (kRowsOfBody + rows[body]) * (moving.awake[body] != 0 ? kAwake : 1u);
    unit->code = std::min(unit->code, curve.code(moving.position[body]));
    unit->weight += cost;
    unit->is_pinned |= is_pinned[body] != 0;
    total += cost;
  };
  for (const std::uint32_t body : movable) {
    const std::uint32_t block = block_of(body);
    if (block != kNoBlock && block >= units.size()) units.resize(block + std::size_t{1});
    if (block != kNoBlock) add(body, &units[block]);
  }
  const std::size_t blocks = units.size();
  for (const std::uint32_t body : movable) {
    if (block_of(body) != kNoBlock) continue;
    add(body, &units.emplace_back());
    ++without_place_;
  }
  std::vector<std::uint32_t> order(units.size());
  std::iota(order.begin(), order.end(), 0u);
  std::ranges::sort(order, [&](std::uint32_t x, std::uint32_t y) {
    return std::pair(units[x].code, x) < std::pair(units[y].code, y);
  });
  std::uint64_t before = 0;
  for (const std::uint32_t k : order) {
    Unit& unit = units[k];
    const std::uint64_t rank = total > 0 ? before * domain_.ranks() / total : 0;
    unit.owner = unit.is_pinned ? Domain::Rank{0} : static_cast<Domain::Rank>(rank);
    before += unit.weight;
  }
  std::vector<Domain::Rank> owners(bodies.capacity(), Domain::kEveryRank);
  movable_.clear();
  std::size_t next = blocks;
  for (const std::uint32_t body : movable) {
    const std::uint32_t block = block_of(body);
    owners[body] = units[block == kNoBlock ? next++ : block].owner;
    if (owners[body] == domain_.rank()) movable_.push_back(body);
  }
  order_.resize(movable_.size());
  std::iota(order_.begin(), order_.end(), 0u);
  std::vector<std::uint64_t> codes;
  for (const std::uint32_t body : movable_) codes.push_back(curve.code(moving.position[body]));
  std::ranges::sort(order_, [&](std::uint32_t x, std::uint32_t y) {
    return std::pair(codes[x], x) < std::pair(codes[y], y);
  });
  domain_.set_owners(std::move(owners), bodies.mobile());
  balance_ = {};
  owners_changed_ = false;
  ghosts_changed_ = true;
}

/// The balance is lost if the load of the busiest rank has grown, in relation to the mean, since
/// the owners were assigned.
void WorldRanks::Balance::update(std::uint64_t most, std::uint64_t mean) {
  constexpr std::uint64_t kUnit = 1024, kMostGrowth = kUnit / 16;
  const std::uint64_t excess = mean > 0 ? most * kUnit / mean : 0;
  if (steps_++ == 0) first_excess_ = excess;
  is_lost_ = steps_ >= kStepsPerBalance && excess > first_excess_ + kMostGrowth;
}

std::uint64_t WorldRanks::load(std::uint64_t awake, const soft_step::ContactSet& contacts) {
  return kRowsOfBody * awake + contacts.spheres.size() +
         kRowsOfManifold * contacts.manifolds.size();
}

void WorldRanks::start_step(BodyStore* bodies, JointStore* joints, std::uint64_t steps,
                            soft_step::ContactSet* last, DetectedContacts* detected) {
  const bool is_due =
      (steps % kStepsPerAssignment == 0 && !bodies->has_blocks()) || balance_.is_lost();
  if (owners_changed_ || is_due) {
    if (is_due && !is_repeated_) pinned_.clear();
    is_repeated_ = false;
    gather_joints(joints);
    std::vector<std::uint8_t> rows = count_rows(*bodies, *last);
    if (!motion_is_complete_ || !last_.has_set) share_positions(bodies, rows);
    std::vector<Domain::Rank> before(domain_.owners().begin(), domain_.owners().end());
    before.resize(bodies->capacity(), Domain::kEveryRank);
    assign_owners(*bodies, rows);
    if (!motion_is_complete_ || !last_.has_detected) migrate_motion(before, bodies, detected);
    if (!last_.has_set) contact_exchange::migrate(&domain_, before, last);
  }
  if (last_.has_set) contact_exchange::keep_own(domain_, last);
  last_.has_set = motion_is_complete_ = joints_are_complete_ = false;
}

/// Fills boxes_. @returns whether all are within enclosures_
bool WorldRanks::sweep_boxes(const BodyView& bodies, Real margin) {
  const std::size_t count = movable_.size();
  boxes_.resize(count);
  const bool has_enclosures = !ghosts_changed_;
  return parallel_reduce(
      domain_.pool(), count, chunk_size(count, 128, 1024), has_enclosures,
      [&](std::size_t first, std::size_t last) {
        bool are_enclosed = has_enclosures;
        for (; first < last; ++first) {
          boxes_[first] = swept_box(bodies, movable_[first], margin);
          are_enclosed = are_enclosed && contains(enclosures_[first], boxes_[first]);
        }
        return are_enclosed;
      },
      std::logical_and<>());
}

/// Fills enclosures_. A larger horizon means fewer selections and more ghosts.
void WorldRanks::enclose(const BodyView& bodies) {
  constexpr Real kLeast = 1, kMost = 16, kFactor = Real(1.5);
  constexpr std::uint32_t kFewUses = 4, kManyUses = 16;
  if (uses_ < kFewUses) horizon_ *= kFactor;
  if (uses_ > kManyUses) horizon_ /= kFactor;
  horizon_ = std::clamp(horizon_, kLeast, kMost);
  uses_ = 0;
  Real sum = 0;
  for (const std::uint32_t body : movable_) sum += bodies.extent[body];
  const Real slack = movable_.empty() ? 0 : kSlack * sum / static_cast<Real>(movable_.size());
  const Real time = horizon_ * bodies.dt;
  enclosures_.resize(movable_.size());
  parallel_for(domain_.pool(), movable_.size(), kBodiesPerGroup * kGroupsPerChunk,
               [&](std::size_t first, std::size_t last) {
                 for (std::size_t k = first; k < last; ++k) {
                   const Real moved = time * length(bodies.velocity[movable_[k]]);
                   enclosures_[k] = enlarged(boxes_[k], slack + moved);
                 }
               });
}

/// Groups of consecutive places, with the boxes around their enclosures.
std::vector<WorldRanks::Group> WorldRanks::groups_of(std::span<const std::uint32_t> places,
                                                     std::size_t size) const {
  std::vector<Group> groups((places.size() + size - 1) / size);
  parallel_for(
      domain_.pool(), groups.size(), kGroupsPerChunk, [&](std::size_t first, std::size_t last) {
        for (std::size_t g = first; g < last; ++g) {
          Group& group = groups[g];
          group.places = places.subspan(g * size, std::min(size, places.size() - g * size));
          for (const std::uint32_t k : group.places) {
            group.box = merged(group.box, enclosures_[k]);
          }
        }
      });
  return groups;
}

/// Appends the places in movable_ of the bodies whose enclosures touch boxes of a rank, to the list
/// of that rank.
void WorldRanks::find_touching(std::span<const Group> groups, const ForeignBoxes& boxes,
                               BodyLists* places) const {
  SpinLock mutex;  // guards *places
  parallel_for(domain_.pool(), groups.size(), kGroupsPerChunk,
               [&](std::size_t first, std::size_t last) {
                 struct Near {
                   Domain::Rank rank;
                   Aabb box;
                 };
                 std::vector<Near> near_group;
                 for (const Group& group : groups.subspan(first, last - first)) {
                   near_group.clear();
                   boxes.visit_overlapping(group.box, [&](const Aabb& box, Domain::Rank rank) {
                     near_group.push_back({rank, box});
                   });
                   if (!std::ranges::is_sorted(near_group, {}, &Near::rank)) {
                     std::ranges::sort(near_group, {}, &Near::rank);
                   }
                   for (std::size_t begin = 0, end = 0; begin < near_group.size(); begin = end) {
                     const Domain::Rank rank = near_group[begin].rank;
                     while (end < near_group.size() && near_group[end].rank == rank) ++end;
                     const auto of_rank = std::span(near_group).subspan(begin, end - begin);
                     const std::lock_guard lock(mutex);
                     for (const std::uint32_t k : group.places) {
                       const auto touches = [&](const Near& near_box) {
                         return overlap(near_box.box, enclosures_[k]);
                       };
                       if (std::ranges::any_of(of_rank, touches)) places->add(rank, k);
                     }
                   }
                 }
               });
}

/// Lends to each rank the bodies whose enclosures touch those of its bodies, and bodies that are
/// joined with its bodies. The ranks first exchange the boxes of groups of bodies, then those of
/// the bodies that touch a group.
void WorldRanks::select_ghosts(const BodyView& bodies, const JointStore& joints) {
  enclose(bodies);
  const std::vector<Group> groups = groups_of(order_, kBodiesPerGroup);
  Communicator::Message message;
  for (const Group& group : groups) append_items(&message, std::span(&group.box, 1));
  foreign_boxes_.receive(domain_.send_to_all(message));
  BodyLists border;
  border.clear(domain_.ranks());
  find_touching(groups, foreign_boxes_, &border);

  const std::span<Communicator::Message> messages = domain_.start_messages();
  std::vector<std::uint8_t> is_near(movable_.size(), 0);
  for (std::size_t r = 0; r < domain_.ranks(); ++r) {
    for (const std::uint32_t k : border.of(r)) {
      append_items(&messages[r], std::span<const Aabb>(&enclosures_[k], 1));
      is_near[k] = 1;
    }
  }
  foreign_boxes_.receive(domain_.send());
  std::vector<std::uint32_t> near_bodies;
  std::ranges::copy_if(order_, std::back_inserter(near_bodies),
                       [&](std::uint32_t k) { return is_near[k] != 0; });
  BodyLists touching;
  touching.clear(domain_.ranks());
  find_touching(groups_of(near_bodies, kBodiesPerBorderGroup), foreign_boxes_, &touching);

  BodyLists lent;
  lent.clear(domain_.ranks());
  for (std::size_t r = 0; r < domain_.ranks(); ++r) {
    for (const std::uint32_t k : touching.of(r)) lent.add(r, movable_[k]);
  }
  for (const JointId id : joints.ids()) {
    const soft_step::JointInput& input = joints.input(id.index);
    if (input.b == soft_step::kWorld || !domain_.crosses(input.a, input.b)) continue;
    lent.add(domain_.other_rank(input.a, input.b), domain_.is_mine(input.a) ? input.a : input.b);
  }
  lent.sort();
  domain_.set_ghosts(std::move(lent));
  ghosts_changed_ = false;
}

void WorldRanks::update_ghosts(BodyStore* bodies, const JointStore& joints, Real margin) {
  const BodyView view = bodies->view_without_ids();
  const bool are_enclosed = sweep_boxes(view, margin);
  if (domain_.any(!are_enclosed)) select_ghosts(view, joints);
  ++uses_;
  MotionArrays* const moving = &bodies->moving;
  domain_.exchange(
      domain_.lent(), domain_.ghosts(), [&](std::uint32_t i) { return motion_of(*moving, i); },
      [&](std::uint32_t i, const BodyMotion& motion) { set_motion(moving, i, motion); });
}

bool WorldRanks::prepare_partition(BodyStore* bodies, std::uint64_t steps) {
  if (!bodies->has_blocks()) return false;
  if (!partition::is_due(steps, bodies->movable_count(), without_place_)) return false;
  if (!motion_is_complete_) {
    std::vector<std::uint8_t> rows(bodies->capacity());
    share_positions(bodies, rows);
  }
  owners_changed_ = true;
  return true;
}

void WorldRanks::check_owners(std::span<const std::uint32_t> stray) {
  if (!domain_.any(!stray.empty())) return;
  Communicator::Message message;
  append_items(&message, stray);
  pinned_.insert(pinned_.end(), stray.begin(), stray.end());
  for (const Communicator::Message& received : domain_.send_to_all(message)) {
    for (MessageReader reader(received); !reader.at_end();) {
      pinned_.push_back(reader.get<std::uint32_t>());
    }
  }
  owners_changed_ = is_repeated_ = true;
  throw OwnersChanged();
}

void WorldRanks::gather(Contacts* contacts, soft_step::ContactSet* set,
                        DetectedContacts* detected) {
  if (!contacts->has_set) contact_exchange::gather(&domain_, set);
  if (!contacts->has_detected) contact_exchange::gather(&domain_, detected);
  *contacts = {true, true};
}

}  // namespace JFPX_ABI
}  // namespace jfpx
