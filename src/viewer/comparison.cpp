/// Differences between runs: contacts bit by bit, drift and energy.
#include "src/viewer/comparison.hpp"

#include <algorithm>
#include <cstring>

namespace jfpx {
inline namespace JFPX_ABI {
namespace view {
namespace {

/// All fields of a contact as bytes without padding.
struct Bits {
  std::uint32_t bodies[2];
  Real numbers[7];
  Contact contact;

  explicit Bits(const Contact& c)
      : bodies{c.a.index, c.b.index},
        numbers{c.normal.x, c.normal.y, c.normal.z, c.point.x, c.point.y, c.point.z, c.distance},
        contact(c) {}
  int compare(const Bits& other) const {
    const int ids = std::memcmp(bodies, other.bodies, sizeof bodies);
    if (ids != 0) return ids;
    // NOLINTNEXTLINE(bugprone-suspicious-memory-comparison): compares the bits
    return std::memcmp(numbers, other.numbers, sizeof numbers);
  }
  bool operator<(const Bits& other) const { return compare(other) < 0; }
};

std::vector<Bits> sorted(std::span<const Contact> contacts) {
  std::vector<Bits> bits(contacts.begin(), contacts.end());
  std::sort(bits.begin(), bits.end());
  return bits;
}

Real volume_of(const Sphere& sphere) {
  return Real(4) / 3 * kPi * sphere.radius * sphere.radius * sphere.radius;
}
Real volume_of(const Box& box) {
  return 8 * box.half_extents.x * box.half_extents.y * box.half_extents.z;
}

Mat3 inertia_of(const Sphere& sphere, Real mass) {
  const Real i = Real(0.4) * mass * sphere.radius * sphere.radius;
  return diagonal({i, i, i});
}
Mat3 inertia_of(const Box& box, Real mass) {
  const Vec3 squares = component_product(box.half_extents, box.half_extents);
  const Real k = mass / 3;
  return diagonal(
      {k * (squares.y + squares.z), k * (squares.x + squares.z), k * (squares.x + squares.y)});
}
Mat3 inertia_of(const Compound& compound, Real mass) {
  const auto weight = [](const CompoundPart& part) {
    return part.density * std::visit([](const auto& s) { return volume_of(s); }, part.shape);
  };
  Real whole = 0;
  for (const CompoundPart& part : compound.parts) whole += weight(part);
  Mat3 sum = diagonal({});
  for (const CompoundPart& part : compound.parts) {
    const Real m = mass * weight(part) / whole;
    const Mat3 own = std::visit([m](const auto& s) { return inertia_of(s, m); }, part.shape);
    const Mat3 turn = to_matrix(part.orientation), arm = skew_symmetric(part.position);
    sum = sum + turn * own * transposed(turn) + arm * transposed(arm) * m;  // parallel axis theorem
  }
  return sum;
}
Mat3 inertia_of(const HalfSpace&, Real) { return diagonal({}); }
Mat3 inertia_of(const Plane&, Real) { return diagonal({}); }

Mat3 inertia_of(const BodyDef& body) {
  if (body.inertia) return *body.inertia;
  return std::visit([&body](const auto& shape) { return inertia_of(shape, body.mass); },
                    body.shape);
}

}  // namespace

std::vector<Contact> different_contacts(std::span<const Contact> expected,
                                        std::span<const Contact> actual) {
  const std::vector<Bits> a = sorted(expected), b = sorted(actual);
  std::vector<Bits> different;
  std::set_symmetric_difference(a.begin(), a.end(), b.begin(), b.end(),
                                std::back_inserter(different));
  std::vector<Contact> contacts;
  contacts.reserve(different.size());
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
    const Vec3 momentum = inertia_of(body) * spin;
    sum +=
        static_cast<double>(body.mass * length_squared(s.velocity) / 2 + dot(momentum, spin) / 2 -
                            body.mass * dot(body.acceleration, s.position));
  }
  return sum;
}

}  // namespace view
}  // namespace JFPX_ABI
}  // namespace jfpx
