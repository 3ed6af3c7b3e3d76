/// The callbacks of a world in a snapshot.
#pragma once

#include <jfpx/contact_generator.hpp>
#include <jfpx/force.hpp>
#include <jfpx/recorded_world.hpp>

#include "src/base/binary_archive.hpp"
#include "src/world/forces/callback_registry.hpp"

#include <memory>
#include <utility>
#include <variant>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {

void write_forces(BinaryWriter* writer, const ForceRegistry& forces);
void write_generators(BinaryWriter* writer, const GeneratorRegistry& generators);

/// The forces of a snapshot: all ids, and the values of the types of force.hpp. User-defined forces
/// cannot be written and must exist in the world.
class ForceRestorer {
 public:
  /// Reads forces and prepares their restoration in `forces`.
  /// @throws InvalidSnapshot if `forces` has other user-defined forces; std::bad_alloc
  ForceRestorer(BinaryReader* reader, const ForceRegistry& forces);
  /// Replaces all forces. Forces that keep id and type also keep their address.
  // NOLINTNEXTLINE(bugprone-exception-escape): std::visit throws for valueless variants only
  void commit(ForceRegistry* forces) noexcept;

 private:
  template <class... Forces>
  static std::variant<std::monostate, Forces...> with_none(const std::variant<Forces...>&);
  /// A force of force.hpp; std::monostate for a user-defined one.
  using Value = decltype(with_none(std::declval<RecordableForce>()));
  static Value value_of(const ForceRegistry::Function& force);
  friend void write_forces(BinaryWriter* writer, const ForceRegistry& forces);

  std::uint64_t next_;
  std::vector<ForceId> ids_;
  std::vector<Value> values_;
  std::vector<std::unique_ptr<ForceRegistry::Function>> created_;  ///< null: kept
};

/// The contact generators of a snapshot, all of which are user-defined.
class GeneratorRestorer {
 public:
  /// @throws InvalidSnapshot if `generators` has other generators
  GeneratorRestorer(BinaryReader* reader, const GeneratorRegistry& generators);
  void commit(GeneratorRegistry* generators) noexcept;

 private:
  std::uint64_t next_ = 0;
  std::vector<ContactGeneratorId> ids_;
  std::vector<std::unique_ptr<GeneratorRegistry::Function>> kept_;  ///< null pointers
};

}  // namespace JFPX_ABI
}  // namespace jfpx
