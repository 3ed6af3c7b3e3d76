/// Reading of forces and their lists by body.
#include "src/world/forces/force_table.hpp"

#include "src/world/forces/force_fields.hpp"

#include <algorithm>
#include <cstring>
#include <type_traits>

namespace jfpx {
inline namespace JFPX_ABI {
namespace {

using Ends = std::array<std::optional<BodyId>, 2>;

/// The bodies to which a force refers.
template <class F>
Ends ends_of(const F& force) {
  return {force.body, std::nullopt};
}
template <Elastic F>
Ends ends_of(const F& spring) {
  return {spring.a.body, spring.b.body};
}
Ends ends_of(const Explosion&) { return {}; }

/// Whether two forces have the same bytes. Different padding yields a false negative.
template <class F>
bool are_same(const F& a, const F& b) {
  static_assert(std::is_trivially_copyable_v<F>);
  return std::memcmp(static_cast<const void*>(&a), static_cast<const void*>(&b), sizeof(F)) == 0;
}

}  // namespace

bool ForceTable::update(const ForceRegistry& forces, const BodyStore& bodies) {
  if (is_current_ && !(all_known_ && read_values())) return all_known_;
  if (!is_current_) {
    all_known_ = find_sources(forces);
    if (all_known_) copy_bodies(bodies);
  }
  is_current_ = false;  // remains false if an allocation fails
  if (all_known_) make_lists(bodies);
  is_current_ = true;
  return all_known_;
}

/// @returns whether the function is a force of this kind
template <class F>
bool ForceTable::add_source(const ForceRegistry::Function& function, Kind<F>* kind) {
  const F* force = function.target<F>();
  if (force == nullptr) return false;
  kind->sources.push_back(force);
  kind->values.push_back(*force);
  kind->orders.push_back(count_++);
  return true;
}

/// @returns whether all forces are types of force.hpp
bool ForceTable::find_sources(const ForceRegistry& forces) {
  ++parameters_version_;
  count_ = 0;
  return std::apply(
      [&](auto&... kind) {
        ((kind.sources.clear(), kind.values.clear(), kind.orders.clear()), ...);
        return std::ranges::all_of(
            forces.ids(), [&](ForceId id) { return (add_source(*forces.find(id), &kind) || ...); });
      },
      kinds_);
}

/// Copies changed parameters. @param names_changed set to true if a force refers to other bodies
template <class F>
void ForceTable::read(Kind<F>* kind, bool* names_changed) {
  for (std::size_t i = 0; i < kind->sources.size(); ++i) {
    const F& now = *kind->sources[i];
    F& value = kind->values[i];
    if (are_same(value, now)) continue;
    if (ends_of(value) != ends_of(now)) *names_changed = true;
    value = now;
    ++parameters_version_;
  }
}
/// @returns whether a force refers to other bodies than before
bool ForceTable::read_values() {
  bool names_changed = false;
  std::apply([&](auto&... kind) { (read(&kind, &names_changed), ...); }, kinds_);
  return names_changed;
}

/// A force that refers to a removed body is in no list.
template <class F>
void ForceTable::list(const BodyStore& bodies, std::uint32_t kind_number, const Kind<F>& kind) {
  for (std::uint32_t number = 0; number < kind.values.size(); ++number) {
    const Ends ends = ends_of(kind.values[number]);
    const auto is_lost = [&](const auto& body) { return body && !bodies.contains(*body); };
    if (std::ranges::any_of(ends, is_lost)) continue;
    const ForceItem item{kind.orders[number], kind_number, number};
    if (!ends[0] && !ends[1] && !Elastic<F>) on_all_.push_back(item);
    for (std::uint32_t end = 0; end < 2; ++end) {
      if (!ends[end]) continue;
      Named named{ends[end]->index, item};
      named.item.is_end_b = end;
      if (ends[1 - end]) named.item.other = ends[1 - end]->index;
      named_.push_back(named);
    }
  }
}

void ForceTable::make_lists(const BodyStore& bodies) {
  ++lists_version_;
  on_all_.clear();
  named_.clear();
  std::uint32_t number = 0;
  std::apply([&](const auto&... kind) { (list(bodies, number++, kind), ...); }, kinds_);
  std::ranges::sort(on_all_, {}, &ForceItem::order);
  std::ranges::sort(named_, {}, [](const Named& named) {
    return std::tuple(named.body, named.item.order, named.item.is_end_b);
  });
  on_body_.clear();
  first_item_.clear();
  for (const Named& named : named_) {
    first_item_.resize(named.body + std::size_t{1}, static_cast<std::uint32_t>(on_body_.size()));
    on_body_.push_back(named.item);
  }
  first_item_.resize(bodies.capacity() + 1, static_cast<std::uint32_t>(on_body_.size()));
}

/// Copies the properties of bodies that the present kinds of forces need.
void ForceTable::copy_bodies(const BodyStore& bodies) {
  const std::size_t capacity = bodies.capacity();
  mass_.assign(std::get<Kind<Gravity>>(kinds_).values.empty() ? 0 : capacity, 0);
  parts_.clear();
  first_part_.assign(std::get<Kind<Buoyancy>>(kinds_).values.empty() ? 0 : capacity + 1, 0);
  for (std::uint32_t body = 0; body < capacity; ++body) {
    if (!mass_.empty()) mass_[body] = bodies.mass(body);
    if (first_part_.empty()) continue;
    for_each_solid_part(bodies.shape(body), [&](const SolidPart& part) { parts_.push_back(part); });
    first_part_[body + std::size_t{1}] = static_cast<std::uint32_t>(parts_.size());
  }
}

ForceView ForceTable::view() const {
  ForceView view;
  std::apply(
      [&]<class... F>(const Kind<F>&... kind) {
        ((static_cast<ForceArray<F>&>(view) = {kind.values.data(),
                                               static_cast<std::uint32_t>(kind.values.size())}),
         ...);
      },
      kinds_);
  view.on_all = on_all_.data();
  view.on_all_count = static_cast<std::uint32_t>(on_all_.size());
  view.on_body = on_body_.data();
  view.on_body_count = static_cast<std::uint32_t>(on_body_.size());
  view.first_item = first_item_.data();
  view.first_item_count = static_cast<std::uint32_t>(first_item_.size());
  view.mass = mass_.data();
  view.mass_count = static_cast<std::uint32_t>(mass_.size());
  view.parts = parts_.data();
  view.part_count = static_cast<std::uint32_t>(parts_.size());
  view.first_part = first_part_.data();
  view.first_part_count = static_cast<std::uint32_t>(first_part_.size());
  return view;
}

}  // namespace JFPX_ABI
}  // namespace jfpx
