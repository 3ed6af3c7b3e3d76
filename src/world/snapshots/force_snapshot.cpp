/// Writing and restoration of callbacks; see the header.
#include "src/world/snapshots/force_snapshot.hpp"

#include "src/world/snapshots/snapshot_fields.hpp"

#include <algorithm>
#include <string>
#include <utility>

namespace jfpx {
inline namespace JFPX_ABI {
namespace {

template <class Id>
void require_ascending(std::span<const Id> ids, std::uint64_t next) {
  std::uint64_t least = 0;
  for (const Id id : ids) {
    BinaryReader::require(id.number >= least && id.number < next,
                          "its list of callbacks is not sorted");
    least = id.number + 1;
  }
}

[[noreturn]] void throw_missing(const char* kind, std::uint64_t number, const char* where) {
  throw InvalidSnapshot("the " + std::string(kind) + ' ' + std::to_string(number) + " is " + where +
                        "; a snapshot does not contain functions of the program, so the world must "
                        "have the same ones, with the same ids, as when the snapshot was taken");
}

constexpr const char* kOnlyInSnapshot = "in the snapshot and not in the world";
constexpr const char* kOnlyInWorld = "in the world and not in the snapshot";
constexpr const char* kUserDefinedForce = "user-defined force";
constexpr const char* kGenerator = "contact generator";

/// Assigns the force of force.hpp that the function holds, if it holds one.
template <class... Forces>
void assign_target(const ForceRegistry::Function& function,
                   std::variant<std::monostate, Forces...>* value) {
  ((function.target<Forces>() != nullptr ? void(*value = *function.target<Forces>()) : void()),
   ...);
}

}  // namespace

ForceRestorer::Value ForceRestorer::value_of(const ForceRegistry::Function& force) {
  Value value;
  assign_target(force, &value);
  return value;
}

void write_forces(BinaryWriter* writer, const ForceRegistry& forces) {
  BinaryWriter& write = *writer;
  write(forces.next(), std::uint64_t{forces.ids().size()});
  for (const ForceId id : forces.ids()) write(id, ForceRestorer::value_of(*forces.find(id)));
}

ForceRestorer::ForceRestorer(BinaryReader* reader, const ForceRegistry& forces)
    : next_(reader->get<std::uint64_t>()) {
  const std::size_t count = reader->count(least_size<ForceId>() + least_size<Value>());
  ids_.resize(count);
  values_.resize(count);
  created_.resize(count);
  for (std::size_t i = 0; i < count; ++i) (*reader)(ids_[i], values_[i]);
  require_ascending<ForceId>(ids_, next_);
  for (std::size_t i = 0; i < count; ++i) {
    const ForceRegistry::Function* existing = forces.find(ids_[i]);
    const bool has_it = existing != nullptr && value_of(*existing).index() == values_[i].index();
    if (has_it) continue;
    std::visit(
        [&]<class F>(const F& force) {
          if constexpr (std::same_as<F, std::monostate>) {
            throw_missing(kUserDefinedForce, ids_[i].number, kOnlyInSnapshot);
          } else {
            created_[i] = std::make_unique<ForceRegistry::Function>(force);
          }
        },
        values_[i]);
  }
  for (const ForceId id : forces.ids()) {
    const bool is_user_defined = value_of(*forces.find(id)).index() == 0;
    const auto found = std::ranges::lower_bound(ids_, id.number, {}, &ForceId::number);
    const auto i = static_cast<std::size_t>(found - ids_.begin());
    const bool is_known = i < count && ids_[i] == id && values_[i].index() == 0;
    if (is_user_defined && !is_known) throw_missing(kUserDefinedForce, id.number, kOnlyInWorld);
  }
}

// NOLINTNEXTLINE(bugprone-exception-escape): std::visit throws for valueless variants only
void ForceRestorer::commit(ForceRegistry* forces) noexcept {
  for (std::size_t i = 0; i < ids_.size(); ++i) {
    if (created_[i] != nullptr) continue;
    std::visit(
        [&]<class F>(const F& force) {
          if constexpr (!std::same_as<F, std::monostate>) {
            *forces->find(ids_[i])->template target<F>() = force;
          }
        },
        values_[i]);
  }
  forces->replace(std::move(ids_), std::move(created_), next_);
}

void write_generators(BinaryWriter* writer, const GeneratorRegistry& generators) {
  (*writer)(generators.next(), generators.ids());
}

GeneratorRestorer::GeneratorRestorer(BinaryReader* reader, const GeneratorRegistry& generators) {
  (*reader)(next_, ids_);
  require_ascending<ContactGeneratorId>(ids_, next_);
  kept_.resize(ids_.size());
  for (const ContactGeneratorId id : ids_) {
    if (generators.find(id) == nullptr) throw_missing(kGenerator, id.number, kOnlyInSnapshot);
  }
  for (const ContactGeneratorId id : generators.ids()) {
    if (!std::ranges::binary_search(ids_, id.number, {}, &ContactGeneratorId::number)) {
      throw_missing(kGenerator, id.number, kOnlyInWorld);
    }
  }
}

void GeneratorRestorer::commit(GeneratorRegistry* generators) noexcept {
  generators->replace(std::move(ids_), std::move(kept_), next_);
}

}  // namespace JFPX_ABI
}  // namespace jfpx
