/// Finding what may touch among many: a tree of bounding spheres, and the ways a world can choose.
#pragma once

#include <jfpx/contact.hpp>

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {

/// How a world finds the pairs whose bounds touch. All give the same contacts, bit for bit.
enum class BroadPhase : std::uint8_t {
  cells,        ///< the sphere collider's own search, as its options say
  hierarchy,    ///< SphereHierarchy; the collider tests the pairs that it finds
  brute_force,  ///< the collider tests every pair: the oracle
};

/// A binary tree of bounding spheres (thesis 4.4.5): each node encloses its two children, a new
/// leaf goes down where the spheres grow least. Leaves keep some slack, so that small moves touch
/// nothing else; a part of the tree that gets lopsided is built anew, which keeps its depth below
/// 2.5 log2(size) + 2 (scapegoat tree, Galperin and Rivest 1993). What is found depends on the
/// spheres alone, not on the history of the tree. Buffers only grow. Const functions may run
/// concurrently, everything else excludes all other calls.
class JFPX_API SphereHierarchy {
 public:
  /// Names a sphere in the tree until it is removed.
  using Leaf = std::uint32_t;

  /// @param slack [-], >= 0: share of its radius by which a sphere may move before the tree follows
  /// @throws InvalidArgument
  explicit SphereHierarchy(Real slack = Real(0.1));

  /// O(log size), amortised. @throws InvalidArgument if a coordinate or the radius is not finite,
  /// or
  ///   the radius not > 0
  Leaf insert(const SphereInstance& sphere);
  /// @throws InvalidArgument for a leaf that is not in the tree
  void remove(Leaf leaf);
  /// Moves or resizes the sphere of a leaf and refits the tree. @returns whether the tree changed
  /// @throws InvalidArgument as insert() and remove() do
  bool update(Leaf leaf, const SphereInstance& sphere);
  /// Replaces everything: spheres[i] becomes leaf i. The best tree, in O(n log n).
  /// @throws InvalidArgument as insert() does; the tree is then empty
  void assign(std::span<const SphereInstance> spheres);

  std::size_t size() const noexcept { return root_ == kNone ? 0 : nodes_[root_].leaves; }
  int depth() const noexcept;  ///< of the deepest leaf, the root's is 0; -1 for an empty tree
  /// @throws InvalidArgument for a leaf that is not in the tree
  const SphereInstance& sphere(Leaf leaf) const;

  /// Replaces `pairs` by all pairs a < b of leaves whose spheres touch, in SphereCollider's
  /// arithmetic, sorted, those inside one child included (erratum E33).
  void find_pairs(std::vector<SpherePair>* pairs) const;
  /// Replaces `leaves` by all whose spheres touch the given one, sorted.
  void find_touching(const SphereInstance& sphere, std::vector<Leaf>* leaves) const;

 private:
  using Index = std::uint32_t;
  static constexpr Index kNone = 0xffffffffu;
  struct Node {
    SphereInstance bounds;  ///< encloses those of the children; of a leaf: with slack
    SphereInstance sphere;  ///< of a leaf: as given
    Index parent = kNone;
    Index child[2] = {kNone, kNone};
    std::uint32_t leaves = 0;  ///< below it; 1 for a leaf, 0 for a node that is not in use
    bool is_leaf() const { return child[0] == kNone; }
  };

  void reserve_geometric(std::size_t free_nodes);
  Index make_node();
  void require(Leaf leaf) const;
  void set_sphere(Index leaf, const SphereInstance& sphere);
  void link(Index leaf);
  void unlink(Index leaf);
  void replace_child(Index above, Index old, Index by);
  void refit(Index node);
  void refit_up(Index node);
  void take_apart(Index node);
  Index build(std::span<Index> leaves, Index parent);
  int depth(Index node) const;
  void add_pairs_inside(Index node, std::vector<SpherePair>* pairs) const;
  void add_pairs_between(Index a, Index b, std::vector<SpherePair>* pairs) const;
  void add_touching(Index node, const SphereInstance& sphere, std::vector<Leaf>* leaves) const;

  Real slack_;
  Index root_ = kNone;
  std::vector<Node> nodes_;
  std::vector<Index> free_;     ///< nodes not in use
  std::vector<Index> scratch_;  ///< leaves of a part that is built anew
};

}  // namespace JFPX_ABI
}  // namespace jfpx
