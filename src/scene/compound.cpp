/// Mass properties of compounds, as sums over their parts.
#include "src/scene/compound.hpp"

#include "src/collide/shapes.hpp"
#include "src/scene/inertia.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace {

double weight(const CompoundPart& part) {
  const double v = std::visit([](const auto& shape) { return detail::volume(shape); }, part.shape);
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
    const Mat3 axes = to_matrix(normalized(part.orientation));
    const auto add = [&](const auto& shape) {
      Vec3 centre = part.position;
      if constexpr (std::is_same_v<std::decay_t<decltype(shape)>, Hull>)
        centre += axes * shape.centre_of_mass();
      const Mat3 rotated = detail::in_world_axes(detail::central_inertia(shape, part_mass), axes);
      sum.centre += centre * share;
      sum.inertia = sum.inertia + rotated + detail::parallel_axis(centre, part_mass);
    };
    std::visit(add, part.shape);
  });
  return sum;
}

Compound centred(Compound compound) {
  const Vec3 centre = mass_properties(compound, 1).centre;
  for (CompoundPart& part : compound.parts) part.position -= centre;
  return compound;
}

}  // namespace JFPX_ABI
}  // namespace jfpx
