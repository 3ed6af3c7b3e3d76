/// The forces of a world in arrays, for devices.
#pragma once

#include "src/world/bodies/body_store.hpp"
#include "src/world/forces/callback_registry.hpp"
#include "src/world/forces/force_view.hpp"

#include <cstdint>
#include <tuple>
#include <utility>
#include <variant>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {

/// Copies of the forces of force.hpp, and a list of the forces on each body. Each step compares the
/// copies with the forces, because users can change forces at any time by World::force(). The lists
/// are rebuilt only after a change.
class ForceTable {
 public:
  /// Must be called after forces or bodies were added, removed or replaced, and after changes of
  /// masses.
  void invalidate() noexcept { is_current_ = false; }
  /// Updates the table.
  /// @returns false if a force is not a type of force.hpp; the table is then invalid
  /// @throws std::bad_alloc
  bool update(const ForceRegistry& forces, const BodyStore& bodies);

  /// Valid until update().
  ForceView view() const;
  /// Changes whenever the parameters of a force change. Never 0 after update().
  std::uint64_t parameters_version() const { return parameters_version_; }
  /// Changes whenever the lists, masses or parts of bodies change. Never 0 after update().
  std::uint64_t lists_version() const { return lists_version_; }

 private:
  /// The forces of one kind.
  template <class F>
  struct Kind {
    std::vector<const F*> sources;  ///< in the registry
    std::vector<F> values;
    std::vector<std::uint32_t> orders;  ///< ForceItem::order
  };
  template <class... F>
  static std::tuple<Kind<F>...> kinds_of(const std::variant<F...>&);
  /// A force that refers to a body.
  struct Named {
    std::uint32_t body = 0;
    ForceItem item;
  };

  template <class F>
  bool add_source(const ForceRegistry::Function& function, Kind<F>* kind);
  bool find_sources(const ForceRegistry& forces);
  template <class F>
  void read(Kind<F>* kind, bool* names_changed);
  bool read_values();
  template <class F>
  void list(const BodyStore& bodies, std::uint32_t kind_number, const Kind<F>& kind);
  void make_lists(const BodyStore& bodies);
  void copy_bodies(const BodyStore& bodies);

  bool is_current_ = false;
  bool all_known_ = false;  ///< whether all forces are types of force.hpp
  std::uint32_t count_ = 0;
  decltype(kinds_of(std::declval<RecordableForce>())) kinds_;
  std::vector<Named> named_;  ///< during make_lists()
  std::vector<ForceItem> on_all_, on_body_;
  std::vector<std::uint32_t> first_item_, first_part_;
  std::vector<Real> mass_;
  std::vector<SolidPart> parts_;
  std::uint64_t parameters_version_ = 0, lists_version_ = 0;
};

}  // namespace JFPX_ABI
}  // namespace jfpx
