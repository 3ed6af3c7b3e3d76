/// The pairs of children of compounds, as in btCompoundCompoundCollisionAlgorithm and
/// btCompoundCollisionAlgorithm of Bullet 3.24. Whether Bullet creates or removes the algorithm of
/// a child is known before the first manifold changes; Bullet then processes the whole pair.
#include "src/bullet/dispatch/compound_commit.hpp"

#include "src/bullet/dispatch/body_wrapper.hpp"
#include "src/bullet/dispatch/contact_point.hpp"
#include "src/bullet/exact_class.hpp"
#include "src/bullet/prefetch.hpp"
#include "src/bullet/reveal.hpp"
#include "src/collide/sphere_pair.hpp"

#include <BulletCollision/BroadphaseCollision/btDbvt.h>
#include <BulletCollision/CollisionDispatch/btCompoundCompoundCollisionAlgorithm.h>
#include <BulletCollision/CollisionDispatch/btHashedSimplePairCache.h>
#include <BulletCollision/CollisionDispatch/btManifoldResult.h>
#include <BulletCollision/CollisionShapes/btCompoundShape.h>
#include <BulletCollision/CollisionShapes/btSphereShape.h>
#include <LinearMath/btAabbUtil2.h>

#include <array>
#include <optional>
#include <typeinfo>

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {

struct ChildCacheTag {
  friend btHashedSimplePairCache* btCompoundCompoundCollisionAlgorithm::*member_of(ChildCacheTag);
};
struct FirstRevisionTag {
  friend int btCompoundCompoundCollisionAlgorithm::*member_of(FirstRevisionTag);
};
struct SecondRevisionTag {
  friend int btCompoundCompoundCollisionAlgorithm::*member_of(SecondRevisionTag);
};
template struct Reveal<ChildCacheTag,
                       &btCompoundCompoundCollisionAlgorithm::m_childCollisionAlgorithmCache>;
template struct Reveal<FirstRevisionTag,
                       &btCompoundCompoundCollisionAlgorithm::m_compoundShapeRevision0>;
template struct Reveal<SecondRevisionTag,
                       &btCompoundCompoundCollisionAlgorithm::m_compoundShapeRevision1>;

namespace {

/// The maximum numbers of overlapping pairs of children, and of nodes of two trees that wait.
constexpr std::size_t kMostChildPairs = 4;
constexpr std::size_t kMostWaiting = 32;

struct CompoundFields : btCompoundCollisionAlgorithm {
  static constexpr auto algorithms = &CompoundFields::m_childCollisionAlgorithms;
  static constexpr auto is_swapped = &CompoundFields::m_isSwapped;
  static constexpr auto revision = &CompoundFields::m_compoundShapeRevision;
};

/// A shape in the world, and its bounds.
struct Placed {
  Placed() = default;
  /// @param index number of the child, or -1 for the shape of a body
  Placed(const btCollisionShape& of, const btTransform& at, int index)
      : shape(&of), number(index), pose(at) {
    of.getAabb(pose, min, max);
  }
  Placed(const btCompoundShape& compound, int child, const btTransform& at)
      : Placed(*compound.getChildShape(child), at * compound.getChildTransform(child), child) {}

  bool overlaps(const Placed& other) const {
    return TestAabbAgainstAabb2(min, max, other.min, other.max);
  }
  btCollisionObjectWrapper wrapper(const btCollisionObjectWrapper& parent) const {
    return {&parent, shape, parent.getCollisionObject(), pose, -1, number};
  }

  const btCollisionShape* shape;
  int number;
  btTransform pose;
  btVector3 min, max;
};

/// Whether the functions of the shape are Bullet's, and one of the algorithms of PairKind may have
/// been created for it.
bool is_simple(const btCollisionShape& shape) {
  if (shape.getShapeType() != SPHERE_SHAPE_PROXYTYPE) {
    return (traits_of(shape) & (kConvex | kPlane)) != 0;
  }
  return type_info_of(shape) == &typeid(btSphereShape);
}
bool has_simple_child(const btCompoundShape& compound, int child) {
  return is_simple(*compound.getChildShape(child));
}

/// Two overlapping shapes whose algorithm exists.
struct ChildPair {
  Placed first, second;  ///< as Bullet passes them to the algorithm
  btCollisionAlgorithm* algorithm;
  PairLink link;
};

/// A pair with a compound, and the state of its update.
class CompoundPair {
 public:
  CompoundPair(const ConvexDispatch& dispatch, std::size_t i)
      : dispatch_(dispatch),
        a_(wrapper_of(*dispatch.batch.body_a(i))),
        b_(wrapper_of(*dispatch.batch.body_b(i))) {}

  /// Finds the pairs of children that touch. Returns false if Bullet must process the pair.
  bool find(const btCompoundCompoundCollisionAlgorithm& algorithm) {
    if (gCompoundCompoundChildShapePairCallback != nullptr) return false;
    const btCompoundShape *a = compound(a_), *b = compound(b_);
    if (a == nullptr || b == nullptr) return false;
    const btDbvt *tree_a = a->getDynamicAabbTree(), *tree_b = b->getDynamicAabbTree();
    if (tree_a == nullptr || tree_b == nullptr ||
        a->getUpdateRevision() != algorithm.*member_of(FirstRevisionTag()) ||
        b->getUpdateRevision() != algorithm.*member_of(SecondRevisionTag())) {
      return false;
    }
    const btTransform &pose_a = a_.getWorldTransform(), &pose_b = b_.getWorldTransform();
    const btSimplePairArray& known =
        (algorithm.*member_of(ChildCacheTag()))->getOverlappingPairArray();
    if (static_cast<std::size_t>(known.size()) > kMostChildPairs) return false;
    for (int k = 0; k < known.size(); ++k) {
      const int i = known[k].m_indexA, j = known[k].m_indexB;
      if (!has_simple_child(*a, i) || !has_simple_child(*b, j)) return false;
      if (!add(Placed(*a, i, pose_a), Placed(*b, j, pose_b),
               static_cast<btCollisionAlgorithm*>(known[k].m_userPointer))) {
        return false;
      }
    }
    if (tree_a->m_root == nullptr || tree_b->m_root == nullptr) return true;
    return find_overlaps(*a, *b, *tree_a->m_root, *tree_b->m_root);
  }
  bool find(const btCompoundCollisionAlgorithm& algorithm) {
    if (gCompoundChildShapePairCallback != nullptr) return false;
    const bool swapped = algorithm.*CompoundFields::is_swapped;
    const btCollisionObjectWrapper &parent = swapped ? b_ : a_, &other = swapped ? a_ : b_;
    const btCompoundShape* const shape = compound(parent);
    const auto& known = algorithm.*CompoundFields::algorithms;
    if (shape == nullptr || shape->getUpdateRevision() != algorithm.*CompoundFields::revision ||
        !is_simple(*other.getCollisionShape())) {
      return false;
    }
    has_one_compound_ = true;
    is_swapped_ = swapped;
    const Placed placed(*other.getCollisionShape(), other.getWorldTransform(), -1);
    for (int i = 0; i < known.size(); ++i) {
      if (known[i] == nullptr) continue;
      if (!has_simple_child(*shape, i)) return false;
      if (!add(Placed(*shape, i, parent.getWorldTransform()), placed, known[i])) return false;
    }
    const btDbvt* tree = shape->getDynamicAabbTree();
    if (tree != nullptr)
      return tree->m_root == nullptr || find_overlaps(*shape, placed, parent, *tree->m_root);
    for (int i = 0; i < known.size(); ++i) {
      if (!mark(*shape, i, parent.getWorldTransform(), placed)) return false;
    }
    return true;
  }

  /// Has the effect of Bullet's algorithm for the pairs of children that have been found.
  void update() {
    btManifoldResult result(&a_, &b_);
    for (std::size_t k = 0; k < count_; ++k) {
      // The algorithm of two spheres clears the manifold.
      if (is_marked_[k] && pairs_[k]->link.kind() == PairKind::spheres) continue;
      btPersistentManifold* manifold = pairs_[k]->link.manifold();
      if (manifold->getNumContacts() == 0) continue;
      result.setPersistentManifold(manifold);
      result.refreshContactPoints();
      result.setPersistentManifold(nullptr);
    }
    for (std::size_t k = 0; k < count_; ++k) {
      if (is_marked_[k] && !update_spheres(*pairs_[k])) run(*pairs_[k], &result);
    }
  }

 private:
  static const btCompoundShape* compound(const btCollisionObjectWrapper& wrapper) {
    const btCollisionShape* shape = wrapper.getCollisionShape();
    if (type_info_of(*shape) != &typeid(btCompoundShape)) return nullptr;
    return static_cast<const btCompoundShape*>(shape);
  }

  /// Adds two children with an algorithm. Returns false if Bullet removes it, or must run it.
  bool add(const Placed& first, const Placed& second, btCollisionAlgorithm* algorithm) {
    if (count_ == kMostChildPairs || !first.overlaps(second)) return false;
    const PairLink link = read_link(algorithm, &dispatch_.dispatcher);
    const bool expected =
        link.kind() == PairKind::spheres
            ? is_sphere(first) && is_sphere(second)
            : !is_concave(link.kind()) &&
                  has_expected_shapes(link.kind(), *first.shape, traits_of(*first.shape),
                                      *second.shape, traits_of(*second.shape));
    if (!expected) return false;
    pairs_[count_].emplace(ChildPair{first, second, algorithm, link});
    ++count_;
    return true;
  }
  static bool is_sphere(const Placed& child) {
    return child.shape->getShapeType() == SPHERE_SHAPE_PROXYTYPE;
  }

  /// The index of the pair of children with these numbers, or count_.
  std::size_t find_known(int i, int j) const {
    std::size_t k = 0;
    while (k < count_ && (pairs_[k]->first.number != i || pairs_[k]->second.number != j)) ++k;
    return k;
  }
  /// Marks a child that may overlap the other body. Returns false if Bullet creates an algorithm.
  bool mark(const btCompoundShape& shape, int i, const btTransform& pose, const Placed& other) {
    const std::size_t known = find_known(i, -1);
    if (known == count_) {
      return has_simple_child(shape, i) && !Placed(shape, i, pose).overlaps(other);
    }
    is_marked_[known] = true;
    return true;
  }

  /// Marks the pairs of leaves that overlap.
  bool find_overlaps(const btCompoundShape& a, const btCompoundShape& b, const btDbvtNode& root_a,
                     const btDbvtNode& root_b) {
    const btTransform &pose_a = a_.getWorldTransform(), &pose_b = b_.getWorldTransform();
    const btTransform to_a = pose_a.inverse() * pose_b;
    struct Waiting {
      const btDbvtNode *a, *b;
    };
    std::array<Waiting, kMostWaiting> waiting;
    std::size_t depth = 1;
    waiting[0] = {&root_a, &root_b};
    while (depth > 0) {
      const Waiting next = waiting[--depth];
      if (next.a->isleaf() && next.b->isleaf()) {
        const int i = next.a->dataAsInt, j = next.b->dataAsInt;
        const std::size_t known = find_known(i, j);
        // Of the two tests, this one is cheaper.
        if (known == count_ && has_simple_child(a, i) && has_simple_child(b, j) &&
            !Placed(a, i, pose_a).overlaps(Placed(b, j, pose_b))) {
          continue;
        }
        if (!overlap(next.a->volume, next.b->volume, to_a)) continue;
        if (known == count_) return false;
        is_marked_[known] = true;
        continue;
      }
      if (!overlap(next.a->volume, next.b->volume, to_a)) continue;
      if (depth + 4 > kMostWaiting) return false;
      // The order of the pairs is unobservable.
      for (int k = 0; k < (next.a->isleaf() ? 1 : 2); ++k) {
        for (int m = 0; m < (next.b->isleaf() ? 1 : 2); ++m) {
          waiting[depth++] = {next.a->isleaf() ? next.a : next.a->childs[k],
                              next.b->isleaf() ? next.b : next.b->childs[m]};
        }
      }
    }
    return true;
  }
  static bool overlap(const btDbvtVolume& a, const btDbvtVolume& b, const btTransform& b_to_a) {
    btVector3 min, max;
    btTransformAabb(b.Mins(), b.Maxs(), btScalar(0), b_to_a, min, max);
    return Intersect(a, btDbvtVolume::FromMM(min, max));
  }

  /// Marks the leaves that overlap the shape of the other body.
  bool find_overlaps(const btCompoundShape& shape, const Placed& other,
                     const btCollisionObjectWrapper& parent, const btDbvtNode& root) {
    const btTransform to_compound = parent.getWorldTransform().inverse() * other.pose;
    btVector3 min, max;
    other.shape->getAabb(to_compound, min, max);
    const btDbvtVolume bounds = btDbvtVolume::FromMM(min, max);
    std::array<const btDbvtNode*, kMostWaiting> waiting;
    std::size_t depth = 1;
    waiting[0] = &root;
    while (depth > 0) {
      const btDbvtNode* next = waiting[--depth];
      if (!Intersect(next->volume, bounds)) continue;
      if (next->isleaf()) {
        if (!mark(shape, next->dataAsInt, parent.getWorldTransform(), other)) return false;
        continue;
      }
      if (depth + 2 > kMostWaiting) return false;
      waiting[depth++] = next->childs[0];
      waiting[depth++] = next->childs[1];
    }
    return true;
  }

  /// Updates the manifold of two spheres of two compounds without Bullet's algorithm. Returns
  /// false, without a change, for other shapes and for contacts that need it.
  bool update_spheres(const ChildPair& pair) const {
    if (pair.link.kind() != PairKind::spheres || has_one_compound_) return false;
    btPersistentManifold* manifold = pair.link.manifold();
    const btCollisionObject &a = *a_.getCollisionObject(), &b = *b_.getCollisionObject();
    if (((a.getCollisionFlags() | b.getCollisionFlags()) & special_collision_flags()) != 0 ||
        manifold->getBody0() != &a) {
      return false;
    }
    const SphereInstance second = sphere_of(pair.second);
    PairContact contact{};
    const bool touching = detail::find_sphere_contact(sphere_of(pair.first), second, &contact);
    if (touching && !has_finite_values(contact)) return false;
    manifold->setNumContacts(0);
    if (!touching) return true;
    write_contact(manifold, contact, state_of(a), state_of(b), second);
    if (manifold->getNumContacts() == 0) return true;
    manifold->getContactPoint(0).m_index0 = pair.first.number;
    manifold->getContactPoint(0).m_index1 = pair.second.number;
    return true;
  }
  static SphereInstance sphere_of(const Placed& child) {
    const btVector3& at = child.pose.getOrigin();
    return {{at.x(), at.y(), at.z()}, static_cast<const btSphereShape*>(child.shape)->getRadius()};
  }

  void run(const ChildPair& pair, btManifoldResult* result) {
    if (has_one_compound_) {
      const btCollisionObjectWrapper child = pair.first.wrapper(is_swapped_ ? b_ : a_);
      is_swapped_ ? result->setBody1Wrap(&child) : result->setBody0Wrap(&child);
      is_swapped_ ? result->setShapeIdentifiersB(-1, pair.first.number)
                  : result->setShapeIdentifiersA(-1, pair.first.number);
      process(pair, child, is_swapped_ ? a_ : b_, result);
    } else {
      const btCollisionObjectWrapper first = pair.first.wrapper(a_),
                                     second = pair.second.wrapper(b_);
      result->setBody0Wrap(&first);
      result->setBody1Wrap(&second);
      result->setShapeIdentifiersA(-1, pair.first.number);
      result->setShapeIdentifiersB(-1, pair.second.number);
      process(pair, first, second, result);
    }
    result->setBody0Wrap(&a_);
    result->setBody1Wrap(&b_);
  }

  void process(const ChildPair& pair, const btCollisionObjectWrapper& first,
               const btCollisionObjectWrapper& second, btManifoldResult* result) const {
    if (pair.link.kind() == PairKind::convex &&
        update_convex(pair.link.manifold(), first, second, result)) {
      return;
    }
    pair.algorithm->processCollision(&first, &second, dispatch_.info, result);
  }

  const ConvexDispatch& dispatch_;
  btCollisionObjectWrapper a_, b_;
  bool has_one_compound_ = false;  ///< the other shape is no compound
  bool is_swapped_ = false;        ///< the compound is the second of the two
  std::array<std::optional<ChildPair>, kMostChildPairs> pairs_;
  std::array<bool, kMostChildPairs> is_marked_{};
  std::size_t count_ = 0;
};

}  // namespace

bool is_compound_algorithm(const btCollisionAlgorithm* algorithm) {
  if (algorithm == nullptr) return false;
  const std::type_info* type = type_info_of(*algorithm);
  return type == &typeid(btCompoundCompoundCollisionAlgorithm) ||
         type == &typeid(btCompoundCollisionAlgorithm);
}

void prefetch_children(const btCollisionAlgorithm& algorithm) {
  if (type_info_of(algorithm) != &typeid(btCompoundCompoundCollisionAlgorithm)) return;
  const auto& compounds = static_cast<const btCompoundCompoundCollisionAlgorithm&>(algorithm);
  prefetch_bytes(compounds.*member_of(ChildCacheTag()), sizeof(btHashedSimplePairCache));
}

bool commit_compound(const ConvexDispatch& dispatch, std::size_t i, CommitCounts* counts) {
  if (!dispatch.runs_algorithms) return false;
  CompoundPair pair(dispatch, i);
  const btCollisionAlgorithm& algorithm = *dispatch.pairs[i].m_algorithm;
  const bool found =
      type_info_of(algorithm) == &typeid(btCompoundCompoundCollisionAlgorithm)
          ? pair.find(static_cast<const btCompoundCompoundCollisionAlgorithm&>(algorithm))
          : pair.find(static_cast<const btCompoundCollisionAlgorithm&>(algorithm));
  if (!found) return false;
  pair.update();
  ++counts->compound_pairs;
  return true;
}

}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
