/// Sums over the parts of an assembly.
#include "src/assembly.hpp"

#include "src/shared/inertia.hpp"

namespace jfpx::inline JFPX_ABI {
namespace {

// In double: the cube of a small float is no float.
double volume(const Sphere& sphere) {
  const auto r = static_cast<double>(sphere.radius);
  return 4.0 / 3.0 * 3.14159265358979323846 * r * r * r;
}
double volume(const Box& box) {
  const Vec3& h = box.half_extents;
  return 8.0 * static_cast<double>(h.x) * static_cast<double>(h.y) * static_cast<double>(h.z);
}
double weight(const AssemblyPart& part) {
  const double v = std::visit([](const auto& shape) { return volume(shape); }, part.shape);
  return v * static_cast<double>(part.density);
}

/// Calls visit(part, its share of the mass).
template <class Visit>
void for_each_share(const Assembly& assembly, Visit visit) {
  double total = 0;
  for (const AssemblyPart& part : assembly.parts) total += weight(part);
  for (const AssemblyPart& part : assembly.parts) {
    visit(part, static_cast<Real>(weight(part) / total));
  }
}

}  // namespace

MassProperties mass_properties(const Assembly& assembly, Real mass) {
  MassProperties sum{{}, diagonal({})};
  for_each_share(assembly, [&](const AssemblyPart& part, Real share) {
    const Real part_mass = mass * share;
    const Vec3 moments =
        std::visit([&](const auto& shape) { return shared::moments_of_inertia(shape, part_mass); },
                   part.shape);
    const Mat3 own =
        shared::in_world_axes(diagonal(moments), to_matrix(normalized(part.orientation)));
    sum.centre += part.position * share;
    sum.inertia = sum.inertia + own + shared::parallel_axis(part.position, part_mass);
  });
  return sum;
}

Assembly centred(Assembly assembly) {
  const Vec3 centre = mass_properties(assembly, 1).centre;
  for (AssemblyPart& part : assembly.parts) part.position -= centre;
  return assembly;
}

Real bounding_radius(const AssemblyPart& part) {
  if (const auto* sphere = std::get_if<Sphere>(&part.shape)) return sphere->radius;
  return length(std::get<Box>(part.shape).half_extents);
}

}  // namespace jfpx::inline JFPX_ABI
