/// A tree of bounding spheres that finds the pairs of touching spheres.
#pragma once

#include <jfpx/contact.hpp>

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {

/// A binary tree of bounding spheres (thesis 4.4.5). Each node encloses its two children, and a new
/// leaf descends to the child whose sphere grows least. Leaf bounds include slack, so that a small
/// motion changes no other node. An unbalanced subtree is rebuilt, which keeps the depth below
/// 2.5 log2(size) + 2 (scapegoat tree, Galperin and Rivest 1993). Query results depend only on the
/// spheres, not on the history of the tree. Buffers grow and never shrink. Const functions may run
/// concurrently with each other; every other function excludes all other calls.
class SphereHierarchy {
 public:
  /// Identifies a sphere in the tree until it is removed.
  using Leaf = std::uint32_t;

  /// @param slack [-], >= 0: fraction of its radius by which a sphere may move without a change of
  ///   the tree
  /// @throws InvalidArgument
  explicit SphereHierarchy(Real slack = Real(0.1));

  /// Takes O(log size) amortized time.
  /// @throws InvalidArgument if a coordinate or the radius is not finite, or the radius is not > 0
  Leaf insert(const SphereInstance& sphere);
  /// @throws InvalidArgument for a leaf that is not in the tree
  void remove(Leaf leaf);
  /// Moves or resizes the sphere of a leaf and refits the tree. @returns whether the tree changed
  /// @throws InvalidArgument under the conditions of insert() and remove()
  bool update(Leaf leaf, const SphereInstance& sphere);
  /// Replaces all leaves: spheres[i] becomes leaf i. Builds the best tree, in O(n log n).
  /// @throws InvalidArgument under the conditions of insert(); the tree is then empty
  void assign(std::span<const SphereInstance> spheres);

  std::size_t size() const noexcept { return root_ == kNone ? 0 : nodes_[root_].leaves; }
  int depth() const noexcept;  ///< of the deepest leaf; 0 for a lone root, -1 if empty
  /// @throws InvalidArgument for a leaf that is not in the tree
  const SphereInstance& sphere(Leaf leaf) const;

  /// Replaces `pairs` by all pairs a < b of leaves whose spheres touch, in the arithmetic of
  /// SphereCollider, sorted. Pairs within one child are included (erratum E33).
  void find_pairs(std::vector<SpherePair>* pairs) const;
  /// Replaces `leaves` by all leaves whose spheres touch the given one, sorted.
  void find_touching(const SphereInstance& sphere, std::vector<Leaf>* leaves) const;

 private:
  using Index = std::uint32_t;
  static constexpr Index kNone = 0xffffffffu;
  struct Node {
    SphereInstance bounds;  ///< encloses the children's bounds; for a leaf: its sphere and slack
    SphereInstance sphere;  ///< for a leaf: the sphere as given
    Index parent = kNone;
    Index child[2] = {kNone, kNone};
    std::uint32_t leaves = 0;  ///< in this subtree; 1 for a leaf, 0 for an unused node
    bool is_leaf() const { return child[0] == kNone; }
  };

  void reserve_geometric(std::size_t free_nodes);
  Index make_node();
  void require(Leaf leaf) const;
  void set_sphere(Index leaf, const SphereInstance& sphere);
  void link(Index leaf);
  void unlink(Index leaf);
  void replace_child(Index above, Index child, Index replacement);
  void refit(Index node);
  void refit_up(Index node);
  void collect_leaves(Index node);
  Index build(std::span<Index> leaves, Index parent);
  int depth(Index node) const;
  void add_pairs_inside(Index node, std::vector<SpherePair>* pairs) const;
  void add_pairs_between(Index a, Index b, std::vector<SpherePair>* pairs) const;
  void add_touching(Index node, const SphereInstance& sphere, std::vector<Leaf>* leaves) const;

  Real slack_;
  Index root_ = kNone;
  std::vector<Node> nodes_;
  std::vector<Index> free_;     ///< unused nodes
  std::vector<Index> scratch_;  ///< leaves of a subtree that is being rebuilt
};

}  // namespace JFPX_ABI
}  // namespace jfpx
