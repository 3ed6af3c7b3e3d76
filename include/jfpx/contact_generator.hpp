/// Contact generators: user-defined contacts (thesis 4.3), for example ropes, rods and other limits
/// on the distance of two bodies, and changes of the contacts that were detected.
#pragma once

#include <jfpx/step_view.hpp>

#include <concepts>
#include <cstdint>
#include <span>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {

struct Contact;
class ContactChanges;

/// Identifies a contact generator of one World. Never reused.
struct ContactGeneratorId {
  std::uint64_t number = 0;
  friend bool operator==(const ContactGeneratorId&, const ContactGeneratorId&) = default;
};

/// A contact of a contact generator. The solver stops the approach of the bodies along the normal
/// and separates them by `-distance`: Solver::soft_step with a soft contact, Solver::worst_first to
/// within ResolverSettings::position_epsilon. If the normal points from a to b, the contact pulls
/// the bodies together, like the end of a rope.
struct GeneratedContact {
  BodyId a = {}, b = {};  ///< two different bodies; one may have mass 0 and represent the world
  Vec3 normal = {};       ///< [-], unit, direction of the impulse on a; b receives the opposite
  Vec3 point = {};        ///< [m], world, point of application: any point on the line of action
  Real distance = 0;      ///< [m], <= 0: the negative of the distance to correct
  Real friction = 0;      ///< [-], >= 0, perpendicular to the normal
  Real restitution = 0;   ///< [-], in [0, 1]
};

/// A detected contact of a step before it is solved: of two bodies, or of two parts of them. Only
/// the last three members may be changed.
struct DetectedContact {
  BodyId a = {}, b = {};  ///< as in Contact
  /// Number of the part in Compound::parts, of the triangle in TriangleMesh::triangles() or, as in
  /// HeightfieldDef, of the triangle of a heightfield; 0 for other shapes and with
  /// Solver::worst_first.
  std::uint32_t part_a = 0, part_b = 0;
  Vec3 normal = {};      ///< [-], unit, from b to a
  Vec3 point = {};       ///< [m], world: the middle of the overlap or gap, at the deepest point
  Real distance = 0;     ///< [m], of the deepest point; > 0: a gap that may close during the step
  Real friction = 0;     ///< [-], >= 0; at first that of the pair
  Real restitution = 0;  ///< [-], in [0, 1]; at first that of the pair
  /// Whether the solver ignores the contact. It is then not in World::contacts(), has no event and
  /// wakes no body.
  bool ignored = false;
};

/// Read access to the world for a contact generator, and recipient of its contacts. Generators run
/// after contact detection (with Solver::worst_first, after integration). Valid during the call, in
/// the calling thread.
class JFPX_API ContactContext : public StepView {
 public:
  ContactContext(const BodyStore& bodies, double time, std::vector<Contact>* contacts,
                 ContactChanges* changes)
      : StepView(bodies, time), contacts_(contacts), changes_(changes) {}

  /// The detected contacts, without those of sensors. The first call in a step makes the list, in
  /// time proportional to its length. Contacts of two spheres precede all others; both are sorted
  /// by (a.index, b.index), then by parts. Solver::worst_first has an item for each point of a
  /// contact. Later generators see the changes of earlier ones; the changes are checked and used
  /// after the last one: InvalidArgument for an invalid material, or another changed member, undoes
  /// the step. In steps in which all contacts of a movable and a fixed body are ignored, continuous
  /// collision ignores the pair, too.
  std::span<DetectedContact> detected();
  /// Adds a contact. A contact of two bodies of mass 0 is ignored. An awake body wakes the other.
  /// @throws InvalidArgument for an id of no living body, or a field out of its range; the step is
  ///   then undone
  void add(const GeneratedContact& contact);

 private:
  std::vector<Contact>* contacts_;
  ContactChanges* changes_;
};

/// Any object callable with a ContactContext. Calls in the same state must have the same result,
/// because a failed step is repeated. An exception undoes the step and propagates to the caller of
/// World::step().
template <class G>
concept ContactGenerator = std::copy_constructible<G> && std::invocable<const G&, ContactContext&>;

}  // namespace JFPX_ABI
}  // namespace jfpx
