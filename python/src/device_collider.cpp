/// Binding of the sphere collider for arrays in device memory, which come as addresses and strides.
#include <jfpx/cuda/array_collider.hpp>

#include "python/src/bindings.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace python {
namespace {

using Address = std::uintptr_t;

template <class T>
T* pointer(Address address) {
  return reinterpret_cast<T*>(address);  // NOLINT(performance-no-int-to-ptr)
}
cuda::Stream to_stream(Address stream) { return pointer<CUstream_st>(stream); }

/// (positions, count, row stride, column stride, radii or 0, radius stride, radius)
using ArraysTuple = std::tuple<Address, std::size_t, std::ptrdiff_t, std::ptrdiff_t, Address,
                               std::ptrdiff_t, double>;
cuda::SphereArrays to_arrays(const ArraysTuple& t) {
  return {.count = std::get<1>(t),
          .positions = pointer<const Real>(std::get<0>(t)),
          .row_stride = std::get<2>(t),
          .column_stride = std::get<3>(t),
          .radii = pointer<const Real>(std::get<4>(t)),
          .radius_stride = std::get<5>(t),
          .radius = static_cast<Real>(std::get<6>(t))};
}
/// A collider, and the numbers of pairs that the next find_pairs() and find_periodic_pairs() are
/// likely to find.
struct DeviceCollider : cuda::ArrayCollider {
  using ArrayCollider::ArrayCollider;
  std::uint64_t expected_pairs = 0, expected_periodic_pairs = 0;
};
cuda::ArrayResult to_result(bool contacts) {
  return contacts ? cuda::ArrayResult::contacts : cuda::ArrayResult::pairs;
}

}  // namespace

void bind_device_collider(nb::module_& module) {
  using Release = nb::call_guard<nb::gil_scoped_release>;
  nb::class_<DeviceCollider>(module, "DeviceCollider")
      .def("__init__", [](DeviceCollider* self, int device) { new (self) DeviceCollider(device); })
      .def_ro("expected_pairs", &DeviceCollider::expected_pairs)
      .def_ro("expected_periodic_pairs", &DeviceCollider::expected_periodic_pairs)
      .def(
          "reserve",
          [](DeviceCollider& self, std::size_t spheres, std::size_t contacts) {
            self.reserve(spheres, contacts);
          },
          Release())
      .def(
          "find",
          [](DeviceCollider& self, const ArraysTuple& spheres, bool contacts, bool both_orders,
             Address stream) {
            return self.find(to_arrays(spheres), to_result(contacts), both_orders,
                             to_stream(stream));
          },
          Release())
      .def(
          "find_pairs",
          [](DeviceCollider& self, const ArraysTuple& spheres, Address indices, bool wide,
             std::size_t capacity, Address stream) {
            const cuda::SphereArrays arrays = to_arrays(spheres);
            self.expected_pairs = wide ? self.find_pairs(arrays, pointer<std::int64_t>(indices),
                                                         capacity, to_stream(stream))
                                       : self.find_pairs(arrays, pointer<std::int32_t>(indices),
                                                         capacity, to_stream(stream));
            return self.expected_pairs;
          },
          Release())
      .def(
          "find_periodic_pairs",
          [](DeviceCollider& self, const ArraysTuple& spheres, const Rows<const double>& cell,
             Address indices, bool wide, Address shifts, std::size_t capacity, Address stream) {
            const auto find = [&](auto* to) {
              return self.find_periodic_pairs(to_arrays(spheres), to_cells(cell).at(0), to,
                                              pointer<std::int32_t>(shifts), capacity,
                                              to_stream(stream));
            };
            self.expected_periodic_pairs =
                wide ? find(pointer<std::int64_t>(indices)) : find(pointer<std::int32_t>(indices));
            return self.expected_periodic_pairs;
          },
          Release())
      .def(
          "find_between",
          [](DeviceCollider& self, const ArraysTuple& first, const ArraysTuple& second,
             bool contacts, Address stream) {
            return self.find_between(to_arrays(first), to_arrays(second), to_result(contacts),
                                     to_stream(stream));
          },
          Release())
      .def(
          "find_in_systems",
          [](DeviceCollider& self, const ArraysTuple& spheres,
             const Vector<const std::uint64_t>& offsets, bool contacts, bool both_orders,
             Address stream) {
            return self.find_in_systems(to_arrays(spheres), {offsets.data(), offsets.size()},
                                        to_result(contacts), both_orders, to_stream(stream));
          },
          Release())
      .def(
          "find_periodic",
          [](DeviceCollider& self, const ArraysTuple& spheres, const Rows<const double>& cell,
             bool contacts, bool both_orders, Address stream) {
            return self.find_periodic(to_arrays(spheres), to_cells(cell).at(0), to_result(contacts),
                                      both_orders, to_stream(stream));
          },
          Release())
      .def(
          "find_periodic_in_systems",
          [](DeviceCollider& self, const ArraysTuple& spheres,
             const Vector<const std::uint64_t>& offsets, const Rows<const double>& cells,
             bool contacts, bool both_orders, Address stream) {
            return self.find_periodic_in_systems(
                to_arrays(spheres), {offsets.data(), offsets.size()}, to_cells(cells),
                to_result(contacts), both_orders, to_stream(stream));
          },
          Release())
      .def(
          "find_periodic_between",
          [](DeviceCollider& self, const ArraysTuple& first, const ArraysTuple& second,
             const Rows<const double>& cell, bool contacts, Address stream) {
            return self.find_periodic_between(to_arrays(first), to_arrays(second),
                                              to_cells(cell).at(0), to_result(contacts),
                                              to_stream(stream));
          },
          Release())
      .def("enqueue",
           [](DeviceCollider& self, const ArraysTuple& spheres, bool contacts, Address stream) {
             self.enqueue(to_arrays(spheres), to_result(contacts), to_stream(stream));
           })
      .def("write_pairs",
           [](DeviceCollider& self, Address a, Address b, bool wide, std::size_t capacity,
              Address stream) {
             if (wide) {
               self.write_pairs(pointer<std::int64_t>(a), pointer<std::int64_t>(b), capacity,
                                to_stream(stream));
             } else {
               self.write_pairs(pointer<std::int32_t>(a), pointer<std::int32_t>(b), capacity,
                                to_stream(stream));
             }
           })
      .def("write_contacts",
           [](DeviceCollider& self, Address normals, Address distances, std::size_t capacity,
              Address stream) {
             self.write_contacts(pointer<Real>(normals), pointer<Real>(distances), capacity,
                                 to_stream(stream));
           })
      .def("write_shifts",
           [](DeviceCollider& self, Address shifts, std::size_t capacity, Address stream) {
             self.write_shifts(pointer<std::int32_t>(shifts), capacity, to_stream(stream));
           })
      .def("write_offsets",
           [](DeviceCollider& self, Address offsets, Address stream) {
             self.write_offsets(pointer<std::int64_t>(offsets), to_stream(stream));
           })
      .def("write_count", [](DeviceCollider& self, Address count, Address stream) {
        self.write_count(pointer<std::int64_t>(count), to_stream(stream));
      });
}

}  // namespace python
}  // namespace JFPX_ABI
}  // namespace jfpx
