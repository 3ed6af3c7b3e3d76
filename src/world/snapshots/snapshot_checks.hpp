/// Checks shared by the parts of a snapshot.
#pragma once

#include "src/base/binary_archive.hpp"
#include "src/contact_solver/soft_step/colors.hpp"
#include "src/contact_solver/soft_step/joint_set.hpp"
#include "src/world/bodies/body_store.hpp"

#include <cstdint>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {

/// The slots of an IdPool in a snapshot.
struct SnapshotSlots {
  std::vector<std::uint32_t> generations, unused;
  std::vector<bool> is_free;  ///< by slot: whether it is one of `unused`

  /// @param invalid message of the error if a slot is unused twice or does not exist
  /// @throws InvalidSnapshot, std::bad_alloc
  void read_unused(BinaryReader* reader, const char* invalid) {
    unused = reader->get<std::vector<std::uint32_t>>();
    is_free.assign(generations.size(), false);
    for (const std::uint32_t slot : unused) {
      BinaryReader::require(slot < is_free.size() && !is_free[slot], invalid);
      is_free[slot] = true;
    }
  }
};

/// The colors of the contacts and joints in a snapshot. Colors of the same body must differ.
class SnapshotColors {
 public:
  /// Messages of the errors.
  struct Messages {
    const char* immovable;  ///< a contact or joint with an immovable body has a color
    const char* same;       ///< two contacts or joints of a body have the same color
  };

  explicit SnapshotColors(std::size_t bodies) : used_(bodies) {}

  /// Adds the color of a contact or joint. @param b may be soft_step::kWorld
  /// @throws InvalidSnapshot
  void add(const BodyStore& bodies, std::uint32_t a, std::uint32_t b, std::uint32_t color,
           const Messages& messages) {
    if (!soft_step::is_color(color)) return;
    BinaryReader::require(b != soft_step::kWorld && bodies.movable(a) && bodies.movable(b),
                          messages.immovable);
    const bool is_inner = soft_step::is_inner_color(color);
    const std::uint64_t bit = std::uint64_t{1} << soft_step::number_in_class(color);
    for (const std::uint32_t body : {a, b}) {
      std::uint64_t& used = used_[body].of_class(is_inner);
      BinaryReader::require((used & bit) == 0, messages.same);
      used |= bit;
    }
  }

 private:
  std::vector<soft_step::UsedColors> used_;  ///< by body
};

}  // namespace JFPX_ABI
}  // namespace jfpx
