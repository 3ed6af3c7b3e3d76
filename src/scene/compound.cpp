/// Mass properties of compounds, as sums over their parts.
#include "src/scene/compound.hpp"

#include "src/scene/inertia.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace {

// Computed in double, because the cube of a small float may underflow.
double volume(const Sphere& sphere) {
  const auto r = static_cast<double>(sphere.radius);
  return 4.0 / 3.0 * 3.14159265358979323846 * r * r * r;
}
double volume(const Box& box) {
  const Vec3& h = box.half_extents;
  return 8.0 * static_cast<double>(h.x) * static_cast<double>(h.y) * static_cast<double>(h.z);
}
double weight(const CompoundPart& part) {
  const double v = std::visit([](const auto& shape) { return volume(shape); }, part.shape);
  return v * static_cast<double>(part.density);
}

/// Calls visit(part, share) for each part, where share is its fraction of the mass.
template <class Visit>
void for_each_share(const Compound& compound, Visit visit) {
  double total = 0;
  for (const CompoundPart& part : compound.parts) total += weight(part);
  for (const CompoundPart& part : compound.parts) {
    visit(part, static_cast<Real>(weight(part) / total));
  }
}

}  // namespace

MassProperties mass_properties(const Compound& compound, Real mass) {
  MassProperties sum{{}, diagonal({})};
  for_each_share(compound, [&](const CompoundPart& part, Real share) {
    const Real part_mass = mass * share;
    const Vec3 moments =
        std::visit([&](const auto& shape) { return detail::moments_of_inertia(shape, part_mass); },
                   part.shape);
    const Mat3 rotated =
        detail::in_world_axes(diagonal(moments), to_matrix(normalized(part.orientation)));
    sum.centre += part.position * share;
    sum.inertia = sum.inertia + rotated + detail::parallel_axis(part.position, part_mass);
  });
  return sum;
}

Compound centred(Compound compound) {
  const Vec3 centre = mass_properties(compound, 1).centre;
  for (CompoundPart& part : compound.parts) part.position -= centre;
  return compound;
}

Real bounding_radius(const CompoundPart& part) {
  if (const auto* sphere = std::get_if<Sphere>(&part.shape)) return sphere->radius;
  return length(std::get<Box>(part.shape).half_extents);
}

}  // namespace JFPX_ABI
}  // namespace jfpx
