/// Declarations shared by the bindings. All files but module.cpp are compiled once in each
/// precision, for the submodules `_core.f32` and `_core.f64`.
#pragma once

#include <jfpx/jfpx.hpp>

#include "src/base/interrupt.hpp"

#include <array>
#include <atomic>
#include <cmath>
#include <memory>
#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>
#include <nanobind/stl/array.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/pair.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/tuple.h>
#include <nanobind/stl/vector.h>
#include <string>
#include <utility>

namespace jfpx {
inline namespace JFPX_ABI {
namespace python {

namespace nb = nanobind;

/// An object is used by a second thread, or by a callback, during a call that released Python's
/// global lock.
class ConcurrentUse : public Error {
 public:
  using Error::Error;
};

/// An object is used after close().
class Closed : public Error {
 public:
  using Error::Error;
};

/// Runs the signal handlers of Python that are due. Only the main thread has any.
/// @throws nb::python_error for an exception of a handler, such as KeyboardInterrupt
inline void handle_signals() {
  const nb::gil_scoped_acquire acquire;
  if (PyErr_CheckSignals() != 0) throw nb::python_error();
}
/// Ends searches of the calling thread by an exception of a signal handler.
struct SignalInterrupt : Interrupt {
  SignalInterrupt() : Interrupt(handle_signals) {}
};

/// Marks an object as in use for the lifetime of the guard.
class UseGuard {
 public:
  /// @throws ConcurrentUse if the object is in use
  UseGuard(std::atomic<bool>& in_use, const char* object) : in_use_(in_use) {
    if (in_use_.exchange(true)) throw ConcurrentUse(message(object));
  }
  ~UseGuard() { in_use_ = false; }
  UseGuard(const UseGuard&) = delete;
  UseGuard& operator=(const UseGuard&) = delete;

  static std::string message(const char* object) {
    return std::string("the ") + object + " is in use by another call; use one for each thread";
  }

 private:
  std::atomic<bool>& in_use_;
};

template <class T>
using Vector = nb::ndarray<T, nb::ndim<1>, nb::device::cpu>;
template <class T>
using Rows = nb::ndarray<T, nb::ndim<2>, nb::device::cpu>;

/// A BodyId as a tuple of Python: (index, generation).
using IdTuple = std::pair<std::uint32_t, std::uint32_t>;
inline IdTuple to_tuple(BodyId id) { return {id.index, id.generation}; }
inline BodyId to_id(const IdTuple& id) { return {id.first, id.second}; }

using Triple = std::array<double, 3>;
using Quadruple = std::array<double, 4>;
inline Vec3 to_vec3(const Triple& v) {
  return {static_cast<Real>(v[0]), static_cast<Real>(v[1]), static_cast<Real>(v[2])};
}
inline nb::tuple to_triple(const Vec3& v) { return nb::make_tuple(v.x, v.y, v.z); }
inline Quat to_quat(const Quadruple& q) {
  return {static_cast<Real>(q[0]), static_cast<Real>(q[1]), static_cast<Real>(q[2]),
          static_cast<Real>(q[3])};
}
inline nb::tuple to_quadruple(const Quat& q) { return nb::make_tuple(q.w, q.x, q.y, q.z); }

/// Row i of an array with at least three columns.
template <class T>
Vec3 vec3_at(const Rows<T>& rows, std::size_t i) {
  return {rows(i, 0), rows(i, 1), rows(i, 2)};
}
inline std::vector<Vec3> to_points(const Rows<const Real>& rows) {
  std::vector<Vec3> points(rows.shape(0));
  for (std::size_t i = 0; i < points.size(); ++i) points[i] = vec3_at(rows, i);
  return points;
}
/// Cells from rows of three lengths, each NaN along an axis that does not repeat.
inline std::vector<PeriodicCell> to_cells(const Rows<const double>& lengths) {
  std::vector<PeriodicCell> cells(lengths.shape(0));
  for (std::size_t i = 0; i < cells.size(); ++i) {
    for (std::size_t k = 0; k < 3; ++k) {
      const double length = lengths(i, k);
      cells[i].repeats[k] = !std::isnan(length);
      cells[i].lengths[static_cast<int>(k)] = static_cast<Real>(length);
    }
  }
  return cells;
}
/// An array (N, columns) that owns the memory of a vector.
template <class Scalar, class Item>
nb::ndarray<nb::numpy, Scalar> own(std::vector<Item>&& items) {
  auto kept = std::make_unique<std::vector<Item>>(std::move(items));
  const nb::capsule owner(kept.get(),
                          [](void* p) noexcept { delete static_cast<std::vector<Item>*>(p); });
  const std::vector<Item>& vector = *kept.release();
  return {const_cast<Item*>(vector.data()), {vector.size(), sizeof(Item) / sizeof(Scalar)}, owner};
}
inline void set_row(const Rows<Real>& rows, std::size_t i, const Vec3& v) {
  rows(i, 0) = v.x;
  rows(i, 1) = v.y;
  rows(i, 2) = v.z;
}

/// States as arrays with a row for each body; orientations are (w, x, y, z).
struct StateArrays {
  Rows<Real> positions, orientations, velocities, angular_velocities;
};
/// @throws InvalidArgument if an array does not have a row for each state
void fill(const StateArrays& arrays, std::span<const BodyState> states);

/// Bodies in their order, for pictures: shape and mass of each.
struct ShownBody {
  const Shape* shape = nullptr;
  Real mass = 0;
  Vec3 acceleration;  ///< BodyDef::acceleration
};
/// The solids, walls and meshes of bodies as arrays: jfpx._view.Geometry.
nb::tuple geometry_of(std::span<const ShownBody> bodies);

/// Options of a collider by their names in Python.
/// @throws InvalidArgument for an unknown name
SphereColliderOptions collider_options(const std::string& backend, const std::string& algorithm,
                                       unsigned threads, int device);

void bind_collider(nb::module_& module);
void bind_nearest(nb::module_& module);
void bind_neighbors(nb::module_& module);
/// Only with the CUDA backend.
void bind_device_collider(nb::module_& module);
void bind_scene(nb::module_& module);
void bind_world(nb::module_& module);
void bind_recording(nb::module_& module);
void register_exceptions();

}  // namespace python
}  // namespace JFPX_ABI
}  // namespace jfpx
