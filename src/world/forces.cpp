/// Validation and application of the forces of force.hpp.
#include <jfpx/error.hpp>
#include <jfpx/force.hpp>

#include "src/scene/scene_validate.hpp"
#include "src/world/force_on_body.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace {

/// Checks the fields of one force, with error messages in the common form.
class Check {
 public:
  Check(const char* force, const ForceContext& context) : force_(force), context_(context) {}

  template <class Value>
  void require(bool good, const char* field, const Value& value, const char* range) const {
    if (good) return;
    throw InvalidArgument(std::string(force_) + ": " + field + " is " + to_text(value) +
                          "; it must be " + range);
  }
  void finite(const char* field, const Vec3& value) const {
    require(is_finite(value), field, value, "finite");
  }
  void finite(const char* field, const Mat3& value) const {
    for (const Vec3& row : value.row) finite(field, row);
  }
  void not_negative(const char* field, Real value) const {
    require(value >= 0 && is_finite(value), field, value, "finite and >= 0");
  }
  void positive(const char* field, Real value) const {
    require(value > 0 && is_finite(value), field, value, "finite and > 0");
  }
  void alive(const char* field, const std::optional<BodyId>& body) const {
    if (!body || context_.contains(*body)) return;
    throw InvalidArgument(std::string(force_) + ": " + field + " (index " +
                          std::to_string(body->index) + ", generation " +
                          std::to_string(body->generation) +
                          ") is unknown; it must be of a living body of this world");
  }
  void spring(const Attachment& a, const Attachment& b, Real stiffness, Real damping,
              Real rest_length) const {
    alive("a.body", a.body);
    alive("b.body", b.body);
    if (a.body == b.body) {
      throw InvalidArgument(std::string(force_) +
                            (a.body ? ": both ends are fixed to one body" : ": no end has a body") +
                            "; it must join two bodies, or a body and the world");
    }
    finite("a.point", a.point);
    finite("b.point", b.point);
    not_negative("stiffness", stiffness);
    not_negative("damping", damping);
    not_negative("rest_length", rest_length);
  }

 private:
  const char* force_;
  const ForceContext& context_;
};

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

/// Applies a force to its body if that lives and is awake, or to all awake bodies.
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
  const Check check("gravity", context);
  check.finite("acceleration", acceleration);
  check.alive("body", body);
}
void Gravity::operator()(ForceContext& context) const { act_on_awake(*this, body, &context); }

void Drag::validate(const ForceContext& context) const {
  const Check check("drag", context);
  check.not_negative("linear", linear);
  check.not_negative("quadratic", quadratic);
  check.finite("wind", wind);
  check.alive("body", body);
}
void Drag::operator()(ForceContext& context) const { act_on_awake(*this, body, &context); }

void Spring::validate(const ForceContext& context) const {
  Check("spring", context).spring(a, b, stiffness, damping, rest_length);
}
void Spring::operator()(ForceContext& context) const { apply_spring(context, *this); }

void Bungee::validate(const ForceContext& context) const {
  Check("bungee", context).spring(a, b, stiffness, damping, rest_length);
}
void Bungee::operator()(ForceContext& context) const { apply_spring(context, *this); }

void Aero::validate(const ForceContext& context) const {
  const Check check("aero", context);
  check.alive("body", body);
  check.finite("tensor", tensor);
  check.finite("point", point);
  check.finite("wind", wind);
}
void Aero::operator()(ForceContext& context) const { act_on_awake(*this, body, &context); }

void AeroControl::validate(const ForceContext& context) const {
  const Check check("aero control", context);
  check.alive("body", body);
  check.finite("lowest", lowest);
  check.finite("base", base);
  check.finite("highest", highest);
  check.finite("point", point);
  check.finite("wind", wind);
  check.require(is_finite(control), "control", control, "finite");
}
void AeroControl::operator()(ForceContext& context) const { act_on_awake(*this, body, &context); }
Mat3 AeroControl::tensor() const { return detail::tensor_at_control(*this); }

void Buoyancy::validate(const ForceContext& context) const {
  const Check check("buoyancy", context);
  check.require(absolute(length_squared(liquid.normal) - 1) <= kUnitTolerance, "liquid.normal",
                liquid.normal, "a unit vector, to a thousandth");
  check.require(is_finite(liquid.offset), "liquid.offset", liquid.offset, "finite");
  check.not_negative("density", density);
  check.not_negative("gravity", gravity);
  check.alive("body", body);
}
void Buoyancy::operator()(ForceContext& context) const { act_on_awake(*this, body, &context); }

void Explosion::validate(const ForceContext& context) const {
  const Check check("explosion", context);
  check.finite("centre", centre);
  check.require(is_finite(start), "start", start, "finite");
  check.not_negative("peak_force", peak_force);
  check.positive("speed", speed);
  check.positive("thickness", thickness);
  check.positive("duration", duration);
}
void Explosion::operator()(ForceContext& context) const {
  for (const BodyId id : context.bodies()) {
    ContextBody target(&context, id);
    detail::act_on(*this, context.time(), &target);
  }
}

}  // namespace JFPX_ABI
}  // namespace jfpx
