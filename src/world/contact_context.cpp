/// Validation of the contacts of contact generators.
#include <jfpx/contact_generator.hpp>
#include <jfpx/error.hpp>
#include <jfpx/scene.hpp>
#include <jfpx/world.hpp>

#include "src/scene/scene_validate.hpp"

#include <string>

namespace jfpx {
inline namespace JFPX_ABI {
namespace {

template <class Value>
void require(bool good, const char* field, const Value& value, const char* range) {
  if (good) return;
  throw InvalidArgument(std::string("generated contact: ") + field + " is " + to_text(value) +
                        "; it must be " + range);
}

}  // namespace

void ContactContext::add(const GeneratedContact& contact) {
  StepView::require(contact.a);
  StepView::require(contact.b);
  if (contact.a == contact.b)
    throw InvalidArgument("generated contact: a and b are one body; they must be two");
  const bool unit = absolute(length_squared(contact.normal) - 1) <= kUnitTolerance;
  jfpx::require(unit, "normal", contact.normal, "a unit vector, to a thousandth");
  jfpx::require(is_finite(contact.point), "point", contact.point, "finite");
  jfpx::require(contact.distance <= 0 && is_finite(contact.distance), "distance", contact.distance,
                "finite and <= 0");
  jfpx::require(contact.friction >= 0 && is_finite(contact.friction), "friction", contact.friction,
                "finite and >= 0");
  jfpx::require(contact.restitution >= 0 && contact.restitution <= 1, "restitution",
                contact.restitution, "in [0, 1]");
  if (!(mass(contact.a) > 0) && !(mass(contact.b) > 0)) return;
  contacts_->push_back({contact.a, contact.b, normalized(contact.normal), contact.point,
                        contact.distance, contact.friction, contact.restitution});
}

}  // namespace JFPX_ABI
}  // namespace jfpx
