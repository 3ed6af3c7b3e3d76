/// The list of detected contacts for contact generators, and the use of its changes; see the
/// header.
#include "src/world/contacts/contact_changes.hpp"

#include <jfpx/contact.hpp>
#include <jfpx/error.hpp>

#include "src/base/parallel_for.hpp"
#include "src/base/reserve.hpp"
#include "src/scene/field_fault.hpp"

#include <algorithm>

namespace jfpx {
inline namespace JFPX_ABI {
namespace {

using soft_step::ContactKey;
using soft_step::ContactView;
using soft_step::ManifoldInput;
using soft_step::OwnMaterial;

constexpr std::size_t kContactsPerListChunk = 1024;

/// The material of a pair by the rules of the world.
OwnMaterial material_of(const BodyStore& bodies, const MaterialSettings& rules,
                        const ContactKey& key) {
  return {combined(rules.friction, bodies.friction(key.a), bodies.friction(key.b)),
          combined(rules.restitution, bodies.restitution(key.a), bodies.restitution(key.b))};
}

bool has_material(const DetectedContact& contact, const OwnMaterial& material) {
  return contact.friction == material.friction && contact.restitution == material.restitution;
}

void check_material(const DetectedContact& contact) {
  require_in_range("detected contact: friction", contact.friction, kNotNegative);
  require_in_range("detected contact: restitution", contact.restitution, kZeroToOne);
}

void require_unchanged(bool is_unchanged) {
  if (is_unchanged) return;
  throw InvalidArgument(
      "detected contact: bodies or parts were changed; only friction, restitution and ignored may "
      "be");
}

BodyPair sorted_pair(const ContactKey& key) {
  return {std::min(key.a, key.b), std::max(key.a, key.b)};
}

}  // namespace

void ContactChanges::start(const BodyStore& bodies, const MaterialSettings& rules, ThreadPool* pool,
                           ContactSet* set, DetectedContacts* found) {
  is_made_ = false;
  contacts_ = nullptr;
  bodies_ = &bodies;
  rules_ = rules;
  pool_ = pool;
  set_ = set;
  found_ = found;
}

void ContactChanges::start(std::vector<Contact>* contacts, std::size_t count) {
  is_made_ = false;
  contacts_ = contacts;
  count_ = count;
}

std::span<DetectedContact> ContactChanges::contacts() {
  if (!is_made_) make_list();
  is_made_ = true;
  return list_;
}

/// Key of a contact of the set.
const ContactKey& ContactChanges::key(std::size_t contact) const {
  const std::size_t spheres = set_->spheres.size();
  return contact < spheres ? set_->spheres[contact].key : set_->manifolds[contact - spheres].key;
}

void ContactChanges::make_list() {
  if (contacts_ == nullptr) {
    make_list_of_set();
    return;
  }
  list_.clear();
  for (const Contact& c : std::span(*contacts_).first(count_)) {
    if (c.sensor) continue;
    list_.push_back({c.a, c.b, 0, 0, c.normal, c.point, c.distance, c.friction, c.restitution});
  }
}

void ContactChanges::make_list_of_set() {
  const ContactView contacts = set_->view();
  const auto describe = [&](std::uint32_t i) {
    const ContactKey& key = contacts.key(i);
    const Vec3& position_b = found_->position[key.b];
    const OwnMaterial material = material_of(*bodies_, rules_, key);
    DetectedContact item{bodies_->id(key.a), bodies_->id(key.b), key.part_a, key.part_b,
                         contacts.normal(i)};
    item.friction = material.friction;
    item.restitution = material.restitution;
    item.distance = contacts.distance(i, 0);
    if (contacts.is_sphere(i)) {
      item.point = middle_point(item.normal, item.distance, {position_b, bodies_->radius(key.b)});
      return item;
    }
    std::uint32_t deepest = 0;
    for (std::uint32_t p = 1; p < contacts.impulse_count(i); ++p) {
      if (contacts.distance(i, p) < contacts.distance(i, deepest)) deepest = p;
    }
    const soft_step::PointInput& point = contacts.points[contacts.manifold(i).first + deepest];
    item.distance = point.distance;
    item.point = position_b + (point.arm_b + item.normal * (point.distance * Real(0.5)));
    return item;
  };
  resize_geometric(&list_, contacts.size());
  parallel_for(pool_, contacts.size(), kContactsPerListChunk,
               [&](std::size_t first, std::size_t last) {
                 for (auto i = static_cast<std::uint32_t>(first); i < last; ++i) {
                   list_[i] = describe(i);
                 }
               });
}

void ContactChanges::check() const {
  for (std::size_t i = 0; i < list_.size(); ++i) {
    const DetectedContact& item = list_[i];
    const ContactKey& k = key(i);
    require_unchanged(item.a == bodies_->id(k.a) && item.b == bodies_->id(k.b) &&
                      item.part_a == k.part_a && item.part_b == k.part_b);
    check_material(item);
  }
}

/// Gives each contact with a changed material its own.
void ContactChanges::change_materials() {
  const std::size_t spheres = set_->spheres.size();
  changed_.clear();
  for (std::size_t i = 0; i < list_.size(); ++i) {
    const DetectedContact& item = list_[i];
    if (has_material(item, material_of(*bodies_, rules_, key(i)))) continue;
    const OwnMaterial own{item.friction, item.restitution};
    if (i < spheres) {
      if (set_->sphere_materials.empty()) assign_geometric(&set_->sphere_materials, spheres, {});
      set_->sphere_materials[i] = own;
    } else {
      set_->manifolds[i - spheres].material = own;
      changed_.emplace_back(key(i), own);
    }
  }
  if (changed_.empty()) return;
  const auto key_of = [](const auto& changed) { return changed.first; };
  std::ranges::sort(changed_, {}, key_of);
  for (std::size_t i = 0; i < found_->contacts.size(); ++i) {
    const auto own = std::ranges::lower_bound(changed_, found_->keys[i], {}, key_of);
    if (own == changed_.end() || own->first != found_->keys[i]) continue;
    found_->contacts[i].friction = own->second.friction;
    found_->contacts[i].restitution = own->second.restitution;
  }
}

void ContactChanges::find_ignored_pairs() {
  const auto by_bodies = [](const BodyPair& x, const BodyPair& y) {
    return std::pair(x.a, x.b) < std::pair(y.a, y.b);
  };
  const auto has_fixed = [&](const ContactKey& k) {
    return !bodies_->movable(k.a) || !bodies_->movable(k.b);
  };
  for (std::size_t i = 0; i < list_.size(); ++i) {
    if (list_[i].ignored && has_fixed(key(i))) pairs_.push_back(sorted_pair(key(i)));
  }
  std::ranges::sort(pairs_, by_bodies);
  for (std::size_t i = 0; i < list_.size() && !pairs_.empty(); ++i) {
    if (list_[i].ignored) continue;
    const auto [first, last] =
        std::equal_range(pairs_.begin(), pairs_.end(), sorted_pair(key(i)), by_bodies);
    pairs_.erase(first, last);
  }
}

/// Removes the touching points of ignored contacts.
void ContactChanges::remove_touches() {
  std::ranges::sort(ignored_);
  std::vector<Contact>& touches = found_->contacts;
  std::size_t kept = 0, kept_of_spheres = 0;
  for (std::size_t i = 0; i < touches.size(); ++i) {
    if (std::ranges::binary_search(ignored_, found_->keys[i])) continue;
    kept_of_spheres += i < found_->sphere_count ? 1 : 0;
    touches[kept] = touches[i];
    found_->keys[kept++] = found_->keys[i];
  }
  touches.resize(kept);
  found_->keys.resize(kept);
  found_->sphere_count = kept_of_spheres;
}

ContactChanges::Ignored ContactChanges::apply() {
  pairs_.clear();
  if (!is_made_) return {};
  check();
  change_materials();
  if (std::ranges::none_of(list_, &DetectedContact::ignored)) return {};
  find_ignored_pairs();
  Ignored result;
  result.pairs = pairs_;
  ignored_.clear();
  const std::size_t spheres = set_->spheres.size();
  for (std::size_t m = 0; m < set_->manifolds.size(); ++m) {
    if (!list_[spheres + m].ignored) continue;
    ignored_.push_back(set_->manifolds[m].key);
    set_->manifolds[m].count = 0;
  }
  result.any_manifold = !ignored_.empty();
  if (result.any_manifold) remove_touches();
  std::size_t kept = 0;
  std::vector<OwnMaterial>& materials = set_->sphere_materials;
  for (std::size_t i = 0; i < spheres; ++i) {
    if (list_[i].ignored) {
      result.touching_spheres += set_->spheres[i].distance <= 0 ? 1 : 0;
      continue;
    }
    if (!materials.empty()) materials[kept] = materials[i];
    set_->spheres[kept++] = set_->spheres[i];
  }
  set_->spheres.resize(kept);
  if (!materials.empty()) materials.resize(kept);
  return result;
}

void ContactChanges::apply(std::size_t* spheres) {
  if (!is_made_) return;
  std::size_t kept = 0, kept_spheres = 0;
  auto item = list_.begin();
  for (std::size_t i = 0; i < contacts_->size(); ++i) {
    Contact& contact = (*contacts_)[i];
    bool is_kept = true;
    if (i < count_ && !contact.sensor) {
      require_unchanged(item->a == contact.a && item->b == contact.b);
      check_material(*item);
      contact.friction = item->friction;
      contact.restitution = item->restitution;
      is_kept = !(item++)->ignored;
    }
    if (!is_kept) continue;
    kept_spheres += i < *spheres ? 1 : 0;
    (*contacts_)[kept++] = contact;
  }
  contacts_->resize(kept);
  *spheres = kept_spheres;
}

std::span<DetectedContact> ContactContext::detected() { return changes_->contacts(); }

}  // namespace JFPX_ABI
}  // namespace jfpx
