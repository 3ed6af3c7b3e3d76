/// The bodies of an inner row on a device.
#pragma once

#include <jfpx/config.hpp>

#include <cstdint>

namespace jfpx {
inline namespace JFPX_ABI {
namespace device {

/// An inner row has the places of its bodies in their block instead of the indices of the bodies,
/// and the number of its contact or joint.
struct InnerBodies {
  std::uint32_t a = 0, b = 0;  ///< places in the block
  std::uint32_t contact = 0;

  template <class Row>
  JFPX_HD static InnerBodies of(const Row& row) {
    return {row.a & 0xffffu, row.a >> 16, row.b};
  }
  template <class Row>
  JFPX_HD void put_into(Row* row) const {
    row->a = a | b << 16;
    row->b = contact;
  }
};

}  // namespace device
}  // namespace JFPX_ABI
}  // namespace jfpx
