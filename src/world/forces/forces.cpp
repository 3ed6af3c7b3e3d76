/// Validation and application of the forces of force.hpp.
#include <jfpx/error.hpp>
#include <jfpx/force.hpp>

#include "src/scene/field_fault.hpp"
#include "src/world/forces/force_fields.hpp"
#include "src/world/forces/force_on_body.hpp"

#include <concepts>
#include <optional>
#include <string>

namespace jfpx {
inline namespace JFPX_ABI {
namespace {

[[noreturn]] void refuse_force(const char* force, const std::string& fault) {
  throw InvalidArgument(std::string(force) + ": " + fault);
}

/// Checks that the bodies of a force, or of a part of a force, exist.
/// @param path of the object in the force, with a dot at its end
template <class T>
void require_alive(const char* force, const ForceContext& context, const T& object,
                   const std::string& path = {}) {
  each_field(object, [&]<class Member>(const auto& field, const Member& member) {
    if constexpr (std::convertible_to<Member, std::optional<BodyId>>) {
      const std::optional<BodyId> body = member;
      if (!body || context.contains(*body)) return;
      refuse_force(force, path + field.name + " (index " + std::to_string(body->index) +
                              ", generation " + std::to_string(body->generation) +
                              ") is unknown; it must be of a living body of this world");
    } else if constexpr (HasFields<Member>) {
      require_alive(force, context, member, path + field.name + ".");
    }
  });
}

/// Checks all fields of a force. @throws InvalidArgument
template <class Force>
void check_force(const char* name, const ForceContext& context, const Force& force) {
  require_alive(name, context, force);
  if constexpr (Elastic<const Force>) {
    if (force.a.body == force.b.body) {
      refuse_force(name, std::string(force.a.body ? "both ends are fixed to one body"
                                                  : "no end has a body") +
                             "; it must join two bodies, or a body and the world");
    }
  }
  const std::string found = find_field_fault(force);
  if (!found.empty()) refuse_force(name, found);
}

/// A body of a ForceContext, for act_on().
class ContextBody {
 public:
  ContextBody(ForceContext* context, BodyId id) : context_(context), id_(id) {}
  BodyState state() const { return context_->state(id_); }
  Real mass() const { return context_->mass(id_); }
  void apply(const Vec3& force) const { context_->apply_force(id_, force); }
  void apply_at(const Vec3& force, const Vec3& point) const {
    context_->apply_force_at_point(id_, force, point);
  }
  void wake() const { context_->wake(id_); }
  template <class Visit>
  void for_each_part(const Visit& visit) const {
    for_each_solid_part(context_->shape(id_), visit);
  }

 private:
  ForceContext* context_;
  BodyId id_;
};

/// Applies a force to its body if the body exists and is awake, or to all awake bodies.
template <class F>
void act_on_awake(const F& force, const std::optional<BodyId>& body, ForceContext* context) {
  const auto act = [&](BodyId id) {
    if (!context->awake(id)) return;
    ContextBody target(context, id);
    detail::act_on(force, &target);
  };
  if (body) {
    if (context->contains(*body)) act(*body);
    return;
  }
  for (const BodyId id : context->bodies()) act(id);
}

detail::MovingPoint moving_point(const ForceContext& context, const Attachment& end) {
  if (!end.body) return {end.point, {}};
  return detail::moving_point(context.state(*end.body), end.point);
}

/// Applies the force of a Spring or a Bungee.
template <class S>
void apply_spring(ForceContext& context, const S& spring) {
  for (const Attachment& end : {spring.a, spring.b}) {
    if (end.body && !context.contains(*end.body)) return;
  }
  if (spring.a.body && spring.b.body) context.link(*spring.a.body, *spring.b.body);
  const detail::MovingPoint a = moving_point(context, spring.a),
                            b = moving_point(context, spring.b);
  const Vec3 force = detail::force_on_end_a(spring, a, b);
  if (spring.a.body) context.apply_force_at_point(*spring.a.body, force, a.position);
  if (spring.b.body) context.apply_force_at_point(*spring.b.body, -force, b.position);
}

}  // namespace

void Gravity::validate(const ForceContext& context) const {
  check_force("gravity", context, *this);
}
void Gravity::operator()(ForceContext& context) const { act_on_awake(*this, body, &context); }

void Drag::validate(const ForceContext& context) const { check_force("drag", context, *this); }
void Drag::operator()(ForceContext& context) const { act_on_awake(*this, body, &context); }

void Spring::validate(const ForceContext& context) const { check_force("spring", context, *this); }
void Spring::operator()(ForceContext& context) const { apply_spring(context, *this); }

void Bungee::validate(const ForceContext& context) const { check_force("bungee", context, *this); }
void Bungee::operator()(ForceContext& context) const { apply_spring(context, *this); }

void Aero::validate(const ForceContext& context) const { check_force("aero", context, *this); }
void Aero::operator()(ForceContext& context) const { act_on_awake(*this, body, &context); }

void AeroControl::validate(const ForceContext& context) const {
  check_force("aero control", context, *this);
}
void AeroControl::operator()(ForceContext& context) const { act_on_awake(*this, body, &context); }
Mat3 AeroControl::tensor() const { return detail::tensor_at_control(*this); }

void Buoyancy::validate(const ForceContext& context) const {
  check_force("buoyancy", context, *this);
  std::string found;
  if (!is_in_range(field("liquid.normal", kUnitVector), liquid.normal, &found) ||
      !is_in_range(field("liquid.offset", kFinite), liquid.offset, &found)) {
    refuse_force("buoyancy", found);
  }
}
void Buoyancy::operator()(ForceContext& context) const { act_on_awake(*this, body, &context); }

void Explosion::validate(const ForceContext& context) const {
  check_force("explosion", context, *this);
}
void Explosion::operator()(ForceContext& context) const {
  for (const BodyId id : context.bodies()) {
    ContextBody target(&context, id);
    detail::act_on(*this, context.time(), &target);
  }
}

}  // namespace JFPX_ABI
}  // namespace jfpx
