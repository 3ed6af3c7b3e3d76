/// Serialization of the types of a snapshot. Each function names all members of its type, so that a
/// new member is a compile error until it is added here or in a list of fields (field.hpp).
#pragma once

#include <jfpx/force.hpp>
#include <jfpx/scene.hpp>
#include <jfpx/world.hpp>

#include "src/base/binary_archive.hpp"
#include "src/scene/scene_fields.hpp"
#include "src/world/forces/force_fields.hpp"

#include <algorithm>
#include <type_traits>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {

void serialize(auto& archive, Is<Vec3> auto& v) { archive(v.x, v.y, v.z); }
void serialize(auto& archive, Is<Quat> auto& q) { archive(q.w, q.x, q.y, q.z); }
void serialize(auto& archive, Is<Mat3> auto& m) { archive(m.row[0], m.row[1], m.row[2]); }

void serialize(auto& archive, Is<Triangle> auto& triangle) {
  archive(triangle[0], triangle[1], triangle[2]);
}
void serialize(auto& archive, Is<BodyId> auto& id) {
  auto& [index, generation] = id;
  archive(index, generation);
}
void serialize(auto& archive, Is<Contact> auto& contact) {
  auto& [a, b, normal, point, distance, friction, restitution, sensor] = contact;
  archive(a, b, normal, point, distance, friction, restitution, sensor);
}

void serialize(auto& archive, Is<ForceId> auto& id) {
  auto& [number] = id;
  archive(number);
}
void serialize(auto& archive, Is<ContactGeneratorId> auto& id) {
  auto& [number] = id;
  archive(number);
}
template <class T>
requires HasFields<T>
void serialize(auto& archive, T& value) {
  each_field(value, [&](const auto&, auto& member) { archive(member); });
}
/// The vertices of a hull have one order, so that a snapshot is that of the world that it restores.
inline void require_order(const Hull& hull, const std::vector<Vec3>& vertices) {
  BinaryReader::require(std::ranges::equal(hull.vertices(), vertices),
                        "the vertices of a hull are not in their order");
}
template <class T>
requires HasFields<T>
void serialize(BinaryReader& reader, T& value) {
  try {
    [[maybe_unused]] std::vector<Vec3> vertices;
    each_field(value, [&](const auto&, auto& member) {
      reader(member);
      if constexpr (std::is_same_v<T, Hull> &&
                    std::is_same_v<std::remove_reference_t<decltype(member)>, std::vector<Vec3>>) {
        vertices = member;
      }
    });
    if constexpr (std::is_same_v<T, Hull>) require_order(value, vertices);
  } catch (const InvalidArgument& error) {  // by the constructor of a shape
    BinaryReader::fail(error.what());
  }
}

}  // namespace JFPX_ABI
}  // namespace jfpx
