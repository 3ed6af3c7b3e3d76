/// Validation of the contacts of contact generators.
#include <jfpx/contact_generator.hpp>
#include <jfpx/error.hpp>
#include <jfpx/scene.hpp>
#include <jfpx/world.hpp>

#include "src/scene/field_fault.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
void ContactContext::add(const GeneratedContact& contact) {
  StepView::require(contact.a);
  StepView::require(contact.b);
  if (contact.a == contact.b)
    throw InvalidArgument("generated contact: a and b are one body; they must be two");
  require_in_range("generated contact: normal", contact.normal, kUnitVector);
  require_in_range("generated contact: point", contact.point, kFinite);
  require_in_range("generated contact: distance", contact.distance,
                   Interval{-kMostReal, 0, "finite and <= 0"});
  require_in_range("generated contact: friction", contact.friction, kNotNegative);
  require_in_range("generated contact: restitution", contact.restitution, kZeroToOne);
  if (!(mass(contact.a) > 0) && !(mass(contact.b) > 0)) return;
  contacts_->push_back({contact.a, contact.b, normalized(contact.normal), contact.point,
                        contact.distance, contact.friction, contact.restitution});
}

}  // namespace JFPX_ABI
}  // namespace jfpx
