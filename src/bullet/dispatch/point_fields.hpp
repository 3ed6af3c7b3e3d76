/// Bitwise comparison of contact points and manifolds by named field, without padding.
#pragma once

#include <jfpx/config.hpp>

#include <BulletCollision/NarrowPhaseCollision/btPersistentManifold.h>

#include <bit>
#include <cstdint>
#include <optional>
#include <string>
#include <type_traits>

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {

/// A field that differs, with both values as numbers and as bits.
struct FieldDifference {
  std::string field;
  double expected = 0, actual = 0;
  std::uint64_t expected_bits = 0, actual_bits = 0;
};

/// Records the first field whose bits differ.
class FieldComparison {
 public:
  void operator()(const char* name, btScalar expected, btScalar actual) {
    using Bits = std::conditional_t<sizeof(btScalar) == 8, std::uint64_t, std::uint32_t>;
    const Bits e = std::bit_cast<Bits>(expected), a = std::bit_cast<Bits>(actual);
    if (e != a && !first_) {
      first_ = {name, static_cast<double>(expected), static_cast<double>(actual), e, a};
    }
  }
  void operator()(const char* name, int expected, int actual) {
    if (expected != actual && !first_) {
      first_ = {name, static_cast<double>(expected), static_cast<double>(actual),
                static_cast<std::uint32_t>(expected), static_cast<std::uint32_t>(actual)};
    }
  }
  /// Compares all four components, because Bullet also copies the unused component.
  void operator()(const char* name, const btVector3& expected, const btVector3& actual) {
    static constexpr const char* kSuffix[] = {".x", ".y", ".z", ".w"};
    for (int i = 0; i < 4 && !first_; ++i) {
      (*this)(name, expected.m_floats[i], actual.m_floats[i]);
      if (first_) first_->field += kSuffix[i];
    }
  }
  void operator()(const char* name, const btTransform& expected, const btTransform& actual) {
    static constexpr const char* kRow[] = {" basis row 0", " basis row 1", " basis row 2"};
    for (int i = 0; i < 3 && !first_; ++i) {
      const std::string row = std::string(name) + kRow[i];
      (*this)(row.c_str(), expected.getBasis()[i], actual.getBasis()[i]);
    }
    if (!first_) {
      (*this)((std::string(name) + " origin").c_str(), expected.getOrigin(), actual.getOrigin());
    }
  }

  const std::optional<FieldDifference>& first() const { return first_; }

 private:
  std::optional<FieldDifference> first_;
};

/// Compares every field of a point. The user's pointer is only compared for being set, because
/// two worlds may have different pointers.
inline void compare_points(const btManifoldPoint& e, const btManifoldPoint& a, FieldComparison* c) {
  (*c)("m_localPointA", e.m_localPointA, a.m_localPointA);
  (*c)("m_localPointB", e.m_localPointB, a.m_localPointB);
  (*c)("m_positionWorldOnB", e.m_positionWorldOnB, a.m_positionWorldOnB);
  (*c)("m_positionWorldOnA", e.m_positionWorldOnA, a.m_positionWorldOnA);
  // Bullet does not initialize the unused component of the normal of two capsules at one place.
  const auto used = [](const btVector3& v) { return btVector3(v.x(), v.y(), v.z()); };
  (*c)("m_normalWorldOnB", used(e.m_normalWorldOnB), used(a.m_normalWorldOnB));
  (*c)("m_distance1", e.m_distance1, a.m_distance1);
  (*c)("m_combinedFriction", e.m_combinedFriction, a.m_combinedFriction);
  (*c)("m_combinedRollingFriction", e.m_combinedRollingFriction, a.m_combinedRollingFriction);
  (*c)("m_combinedSpinningFriction", e.m_combinedSpinningFriction, a.m_combinedSpinningFriction);
  (*c)("m_combinedRestitution", e.m_combinedRestitution, a.m_combinedRestitution);
  (*c)("m_partId0", e.m_partId0, a.m_partId0);
  (*c)("m_partId1", e.m_partId1, a.m_partId1);
  (*c)("m_index0", e.m_index0, a.m_index0);
  (*c)("m_index1", e.m_index1, a.m_index1);
  (*c)("m_userPersistentData set", e.m_userPersistentData != nullptr ? 1 : 0,
       a.m_userPersistentData != nullptr ? 1 : 0);
  (*c)("m_contactPointFlags", e.m_contactPointFlags, a.m_contactPointFlags);
  (*c)("m_appliedImpulse", e.m_appliedImpulse, a.m_appliedImpulse);
  (*c)("m_prevRHS", e.m_prevRHS, a.m_prevRHS);
  (*c)("m_appliedImpulseLateral1", e.m_appliedImpulseLateral1, a.m_appliedImpulseLateral1);
  (*c)("m_appliedImpulseLateral2", e.m_appliedImpulseLateral2, a.m_appliedImpulseLateral2);
  (*c)("m_contactMotion1", e.m_contactMotion1, a.m_contactMotion1);
  (*c)("m_contactMotion2", e.m_contactMotion2, a.m_contactMotion2);
  (*c)("m_contactCFM", e.m_contactCFM, a.m_contactCFM);
  (*c)("m_contactERP", e.m_contactERP, a.m_contactERP);
  (*c)("m_frictionCFM", e.m_frictionCFM, a.m_frictionCFM);
  (*c)("m_lifeTime", e.m_lifeTime, a.m_lifeTime);
  (*c)("m_lateralFrictionDir1", e.m_lateralFrictionDir1, a.m_lateralFrictionDir1);
  (*c)("m_lateralFrictionDir2", e.m_lateralFrictionDir2, a.m_lateralFrictionDir2);
}

/// "field: expected X (0x..), actual Y (0x..)"
std::string to_text(const FieldDifference& difference);

}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
