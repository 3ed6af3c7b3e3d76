/// What differs between runs.
#include "examples/viewer/comparison.hpp"

#include <algorithm>
#include <cstring>

namespace jfpx::inline JFPX_ABI::view {
namespace {

/// All that a contact says, as bytes without padding.
struct Bits {
  std::uint32_t bodies[2];
  Real numbers[7];
  Contact contact;

  explicit Bits(const Contact& c)
      : bodies{c.a, c.b},
        numbers{c.normal.x, c.normal.y, c.normal.z, c.point.x, c.point.y, c.point.z, c.distance},
        contact(c) {}
  int compare(const Bits& other) const {
    const int ids = std::memcmp(bodies, other.bodies, sizeof bodies);
    return ids != 0 ? ids : std::memcmp(numbers, other.numbers, sizeof numbers);
  }
  bool operator<(const Bits& other) const { return compare(other) < 0; }
};

std::vector<Bits> sorted(std::span<const Contact> contacts) {
  std::vector<Bits> bits(contacts.begin(), contacts.end());
  std::sort(bits.begin(), bits.end());
  return bits;
}

Vec3 moments_of_inertia(const BodyDef& body) {
  if (const Box* box = std::get_if<Box>(&body.shape)) {
    const Vec3 squares = component_product(box->half_extents, box->half_extents);
    const Real k = body.mass / 3;
    return {k * (squares.y + squares.z), k * (squares.x + squares.z), k * (squares.x + squares.y)};
  }
  const Sphere* sphere = std::get_if<Sphere>(&body.shape);
  const Real i = sphere != nullptr ? Real(0.4) * body.mass * sphere->radius * sphere->radius : 0;
  return {i, i, i};
}

}  // namespace

std::vector<Contact> different_contacts(std::span<const Contact> expected,
                                        std::span<const Contact> actual) {
  const std::vector<Bits> a = sorted(expected), b = sorted(actual);
  std::vector<Bits> different;
  std::set_symmetric_difference(a.begin(), a.end(), b.begin(), b.end(),
                                std::back_inserter(different));
  std::vector<Contact> contacts;
  for (const Bits& bits : different) contacts.push_back(bits.contact);
  return contacts;
}

double drift(const Scene& scene, std::span<const BodyState> a, std::span<const BodyState> b) {
  double sum = 0;
  std::size_t movable = 0;
  for (std::size_t i = 0; i < scene.bodies.size(); ++i) {
    if (scene.bodies[i].mass == 0) continue;
    sum += static_cast<double>(length(a[i].position - b[i].position));
    ++movable;
  }
  return movable > 0 ? sum / static_cast<double>(movable) : 0;
}

double energy(const Scene& scene, std::span<const BodyState> states) {
  double sum = 0;
  for (std::size_t i = 0; i < scene.bodies.size(); ++i) {
    const BodyDef& body = scene.bodies[i];
    const BodyState& s = states[i];
    const Vec3 spin = transform_transpose(to_matrix(s.orientation), s.angular_velocity);
    const Vec3 momentum = component_product(moments_of_inertia(body), spin);
    sum +=
        static_cast<double>(body.mass * length_squared(s.velocity) / 2 + dot(momentum, spin) / 2 -
                            body.mass * dot(body.acceleration, s.position));
  }
  return sum;
}

}  // namespace jfpx::inline JFPX_ABI::view
