/// Insertion, removal, balancing and queries of the tree of bounding spheres.
#include "src/thesis/sphere_hierarchy.hpp"

#include <jfpx/error.hpp>

#include "src/base/reserve.hpp"
#include "src/collide/bounding_sphere.hpp"
#include "src/collide/sphere_pair.hpp"
#include "src/scene/field_fault.hpp"

#include <algorithm>
#include <string>

namespace jfpx {
inline namespace JFPX_ABI {
namespace {

bool touch(const SphereInstance& a, const SphereInstance& b) {
  return detail::test_sphere_pair(a, b).touching != 0;
}

void check(const SphereInstance& sphere) {
  require_in_range("centre", sphere.centre, kFinite);
  require_in_range("radius", sphere.radius, kPositive);
}

/// Whether one child holds more than three quarters of the leaves.
bool unbalanced(std::uint32_t leaves, std::uint32_t of_child) {
  return of_child > 2 && std::uint64_t{4} * of_child > std::uint64_t{3} * leaves;
}

Vec3 extent(const Aabb& box) { return box.upper - box.lower; }

}  // namespace

SphereHierarchy::SphereHierarchy(Real slack) : slack_(slack) {
  require_in_range("slack", slack, kNotNegative);
}

SphereHierarchy::Leaf SphereHierarchy::insert(const SphereInstance& sphere) {
  check(sphere);
  reserve_geometric(2);
  const Index leaf = make_node();
  set_sphere(leaf, sphere);
  link(leaf);
  return leaf;
}

void SphereHierarchy::remove(Leaf leaf) {
  require(leaf);
  reserve_geometric(0);
  unlink(leaf);
  nodes_[leaf] = {};
  free_.push_back(leaf);
}

bool SphereHierarchy::update(Leaf leaf, const SphereInstance& sphere) {
  require(leaf);
  check(sphere);
  if (detail::encloses(nodes_[leaf].bounds, sphere)) {
    nodes_[leaf].sphere = sphere;
    return false;
  }
  reserve_geometric(0);
  if (root_ == leaf) {
    set_sphere(leaf, sphere);
    return true;
  }
  unlink(leaf);
  set_sphere(leaf, sphere);
  link(leaf);
  return true;
}

void SphereHierarchy::assign(std::span<const SphereInstance> spheres) {
  root_ = kNone;
  nodes_.clear();
  free_.clear();
  for (const SphereInstance& sphere : spheres) check(sphere);
  if (spheres.empty()) return;
  nodes_.resize(2 * spheres.size() - 1);
  reserve_geometric(0);
  scratch_.clear();
  for (Index i = 0; i < spheres.size(); ++i) {
    set_sphere(i, spheres[i]);
    scratch_.push_back(i);
  }
  for (auto i = static_cast<Index>(nodes_.size()); i-- > spheres.size();) free_.push_back(i);
  root_ = build(scratch_, kNone);
}

int SphereHierarchy::depth() const noexcept { return root_ == kNone ? -1 : depth(root_); }

int SphereHierarchy::depth(Index node) const {
  const Node& n = nodes_[node];
  return n.is_leaf() ? 0 : 1 + std::max(depth(n.child[0]), depth(n.child[1]));
}

const SphereInstance& SphereHierarchy::sphere(Leaf leaf) const {
  require(leaf);
  return nodes_[leaf].sphere;
}

/// The only function that allocates; it runs before the tree changes.
void SphereHierarchy::reserve_geometric(std::size_t free_nodes) {
  const std::size_t nodes = nodes_.size() + free_nodes - std::min(free_nodes, free_.size());
  jfpx::reserve_geometric(&nodes_, nodes);
  free_.reserve(nodes_.capacity());
  scratch_.reserve(nodes_.capacity());
  while (nodes_.size() < nodes) {
    nodes_.emplace_back();
    free_.push_back(static_cast<Index>(nodes_.size() - 1));
  }
}

SphereHierarchy::Index SphereHierarchy::make_node() {
  const Index node = free_.back();
  free_.pop_back();
  return node;
}

void SphereHierarchy::require(Leaf leaf) const {
  if (leaf < nodes_.size() && nodes_[leaf].leaves == 1) return;
  throw InvalidArgument("leaf " + std::to_string(leaf) + " is unknown; it must be in the tree");
}

void SphereHierarchy::set_sphere(Index leaf, const SphereInstance& sphere) {
  nodes_[leaf].sphere = sphere;
  nodes_[leaf].bounds = {sphere.centre, detail::safe_radius(sphere.radius * (1 + slack_))};
  nodes_[leaf].leaves = 1;
}

/// Makes the leaf a sibling of the node that it enlarges least.
void SphereHierarchy::link(Index leaf) {
  if (root_ == kNone) {
    root_ = leaf;
    return;
  }
  const SphereInstance& bounds = nodes_[leaf].bounds;
  Index beside = root_;
  while (!nodes_[beside].is_leaf()) {
    const auto [first, second] = nodes_[beside].child;
    const Real by_first = detail::growth(nodes_[first].bounds, bounds);
    const Real by_second = detail::growth(nodes_[second].bounds, bounds);
    // Coincident spheres enlarge no node; they descend to the child with fewer leaves.
    const bool to_second = by_second < by_first || (!(by_first < by_second) &&
                                                    nodes_[second].leaves < nodes_[first].leaves);
    beside = to_second ? second : first;
  }
  const Index parent = make_node();
  const Index above = nodes_[beside].parent;
  nodes_[parent].parent = above;
  nodes_[parent].child[0] = beside;
  nodes_[parent].child[1] = leaf;
  nodes_[beside].parent = nodes_[leaf].parent = parent;
  replace_child(above, beside, parent);
  refit_up(parent);
}

/// Removes a leaf and its parent; the sibling replaces the parent.
void SphereHierarchy::unlink(Index leaf) {
  const Index parent = nodes_[leaf].parent;
  nodes_[leaf].parent = kNone;
  if (parent == kNone) {
    root_ = kNone;
    return;
  }
  const Index above = nodes_[parent].parent;
  const Index sibling = nodes_[parent].child[nodes_[parent].child[0] == leaf ? 1 : 0];
  nodes_[sibling].parent = above;
  replace_child(above, parent, sibling);
  nodes_[parent] = {};
  free_.push_back(parent);
  refit_up(above);
}

void SphereHierarchy::replace_child(Index above, Index child, Index replacement) {
  if (above == kNone) {
    root_ = replacement;
  } else {
    nodes_[above].child[nodes_[above].child[0] == child ? 0 : 1] = replacement;
  }
}

void SphereHierarchy::refit(Index node) {
  Node& n = nodes_[node];
  const Node &first = nodes_[n.child[0]], &second = nodes_[n.child[1]];
  n.bounds = detail::enclosing(first.bounds, second.bounds);
  n.leaves = first.leaves + second.leaves;
}

/// Refits a node and all of its ancestors, then rebuilds the largest unbalanced subtree.
void SphereHierarchy::refit_up(Index node) {
  Index worst = kNone;
  for (; node != kNone; node = nodes_[node].parent) {
    refit(node);
    for (const Index child : nodes_[node].child) {
      if (unbalanced(nodes_[node].leaves, nodes_[child].leaves)) worst = node;
    }
  }
  if (worst == kNone) return;
  const Index parent = nodes_[worst].parent;
  scratch_.clear();
  collect_leaves(worst);
  replace_child(parent, worst, build(scratch_, parent));
  for (Index above = parent; above != kNone; above = nodes_[above].parent) refit(above);
}

/// Appends the leaves of a subtree to scratch_ and frees all of its inner nodes.
void SphereHierarchy::collect_leaves(Index node) {
  if (nodes_[node].is_leaf()) {
    scratch_.push_back(node);
    return;
  }
  const auto [first, second] = nodes_[node].child;
  nodes_[node] = {};
  free_.push_back(node);
  collect_leaves(first);
  collect_leaves(second);
}

/// Splits the leaves at the median of the axis along which their centres spread most.
SphereHierarchy::Index SphereHierarchy::build(std::span<Index> leaves, Index parent) {
  if (leaves.size() == 1) {
    nodes_[leaves[0]].parent = parent;
    return leaves[0];
  }
  Aabb box;
  for (const Index leaf : leaves) {
    const Vec3& centre = nodes_[leaf].bounds.centre;
    box = merged(box, {centre, centre});
  }
  const Vec3 size = extent(box);
  const int axis = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
  const auto middle = leaves.begin() + static_cast<std::ptrdiff_t>(leaves.size() / 2);
  std::nth_element(leaves.begin(), middle, leaves.end(), [&](Index a, Index b) {
    const Real at_a = nodes_[a].bounds.centre[axis], at_b = nodes_[b].bounds.centre[axis];
    return at_a < at_b || (at_a == at_b && a < b);
  });
  const Index node = make_node();
  nodes_[node].parent = parent;
  nodes_[node].child[0] = build({leaves.begin(), middle}, node);
  nodes_[node].child[1] = build({middle, leaves.end()}, node);
  refit(node);
  return node;
}

void SphereHierarchy::find_pairs(std::vector<SpherePair>* pairs) const {
  pairs->clear();
  if (root_ != kNone) add_pairs_inside(root_, pairs);
  std::ranges::sort(*pairs, {}, [](const SpherePair& p) { return std::uint64_t{p.a} << 32 | p.b; });
}

void SphereHierarchy::add_pairs_inside(Index node, std::vector<SpherePair>* pairs) const {
  const Node& n = nodes_[node];
  if (n.is_leaf()) return;
  add_pairs_inside(n.child[0], pairs);
  add_pairs_inside(n.child[1], pairs);
  add_pairs_between(n.child[0], n.child[1], pairs);
}

void SphereHierarchy::add_pairs_between(Index a, Index b, std::vector<SpherePair>* pairs) const {
  const Node &first = nodes_[a], &second = nodes_[b];
  if (!touch(first.bounds, second.bounds)) return;
  if (first.is_leaf() && second.is_leaf()) {
    if (touch(first.sphere, second.sphere)) pairs->push_back({std::min(a, b), std::max(a, b)});
    return;
  }
  // Descends into the larger node: its children are more likely to be separate from the other node.
  const bool split_first =
      second.is_leaf() || (!first.is_leaf() && first.bounds.radius > second.bounds.radius);
  const Index whole = split_first ? b : a;
  for (const Index child : (split_first ? first : second).child) {
    add_pairs_between(whole, child, pairs);
  }
}

void SphereHierarchy::find_touching(const SphereInstance& sphere, std::vector<Leaf>* leaves) const {
  check(sphere);
  leaves->clear();
  if (root_ != kNone) add_touching(root_, sphere, leaves);
  std::ranges::sort(*leaves);
}

void SphereHierarchy::add_touching(Index node, const SphereInstance& sphere,
                                   std::vector<Leaf>* leaves) const {
  const Node& n = nodes_[node];
  const SphereInstance wider{sphere.centre, detail::safe_radius(sphere.radius)};
  if (!touch(n.bounds, wider)) return;
  if (n.is_leaf()) {
    if (touch(n.sphere, sphere)) leaves->push_back(node);
    return;
  }
  for (const Index child : n.child) add_touching(child, sphere, leaves);
}

}  // namespace JFPX_ABI
}  // namespace jfpx
