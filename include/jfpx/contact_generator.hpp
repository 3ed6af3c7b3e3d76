/// Contacts that users make (thesis 4.3, contact generators): ropes, rods, and what else may keep
/// two bodies apart or together.
#pragma once

#include <jfpx/step_view.hpp>

#include <concepts>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {

struct Contact;

/// Names a contact generator of one World. Never used twice.
struct ContactGeneratorId {
  std::uint64_t number = 0;
  friend bool operator==(const ContactGeneratorId&, const ContactGeneratorId&) = default;
};

/// What a contact generator asks for: that the bodies cease to approach each other along the
/// normal, and part by `-distance` but for the resolver's position epsilon. Normal and bodies may
/// be chosen so that "to part" means to come closer, as at the end of a rope.
struct GeneratedContact {
  BodyId a = {}, b = {};  ///< different; one of mass 0 stands for the surroundings, wherever it is
  Vec3 normal = {};       ///< [-], unit, the way in which a is pushed; b goes the other way
  Vec3 point = {};        ///< [m], world, where both are pushed: any point on the line of the push
  Real distance = 0;      ///< [m], <= 0
  Real friction = 0;      ///< [-], >= 0, across the normal
  Real restitution = 0;   ///< [-], in [0, 1]
};

/// What a contact generator sees, after bodies were moved and their contacts found, and where it
/// leaves its own.
class JFPX_API ContactContext : public StepView {
 public:
  ContactContext(const BodyStore& bodies, double time, std::vector<Contact>* contacts)
      : StepView(bodies, time), contacts_(contacts) {}

  /// Between two bodies of mass 0 nothing happens. Whoever sleeps is woken by the other.
  /// @throws InvalidArgument for a body that does not live or a field that is out of its range; the
  ///   step is then undone
  void add(const GeneratedContact& contact);

 private:
  std::vector<Contact>* contacts_;
};

/// Anything that can be called with a ContactContext. It must do the same when called again in the
/// same state, for a failed step is repeated. Exceptions undo the step and reach the caller of
/// World::step().
template <class G>
concept ContactGenerator = std::copy_constructible<G> && std::invocable<const G&, ContactContext&>;

}  // namespace JFPX_ABI
}  // namespace jfpx
