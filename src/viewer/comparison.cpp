/// Differences between runs: contacts bit by bit, drift and energy.
#include "src/viewer/comparison.hpp"

#include "src/scene/compound.hpp"

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

Mat3 inertia_of(const BodyDef& body) {
  return body.inertia ? *body.inertia : solid_inertia(body.shape, body.mass);
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
