/// Binding of recordings and trajectories.
#include <jfpx/recording.hpp>
#include <jfpx/trajectory.hpp>

#include "python/src/bindings.hpp"
#include "python/src/world.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace python {
namespace {

/// A writer that discard() ends with its unfinished file.
template <class FileWriter>
struct Writer {
  std::optional<FileWriter> writer;
  FileWriter& get() {
    if (!writer) throw Closed("the file is finished, or was given up");
    return *writer;
  }
};

template <class FileWriter>
nb::class_<Writer<FileWriter>> bind_writer(nb::module_& module, const char* name) {
  using Self = Writer<FileWriter>;
  return nb::class_<Self>(module, name)
      .def("finish",
           [](Self& self) {
             self.get().finish();
             self.writer.reset();
           })
      .def("is_open", [](const Self& self) { return self.writer.has_value(); })
      .def("discard", [](Self& self) { self.writer.reset(); });
}

}  // namespace

void bind_recording(nb::module_& module) {
  using Recording = Writer<RecordingWriter>;
  bind_writer<RecordingWriter>(module, "RecordingWriter")
      .def("__init__",
           [](Recording* self, const std::string& path, const PythonWorld& world) {
             new (self) Recording{RecordingWriter(
                 path, {.engine = "native", .backend = "cpu", .scene = world.scene()})};
           })
      .def("append", [](Recording& self, const PythonWorld& world) {
        self.get().append(world.get().states());
      });
  using Trajectory = Writer<TrajectoryWriter>;
  bind_writer<TrajectoryWriter>(module, "TrajectoryWriter")
      .def("__init__",
           [](Trajectory* self, const std::string& path) {
             new (self) Trajectory{TrajectoryWriter(path)};
           })
      .def("append",
           [](Trajectory& self, const PythonWorld& world) { self.get().append(world.get()); });

  nb::class_<RecordingReader>(module, "RecordingReader")
      .def(nb::init<const std::string&>())
      .def_prop_ro("engine", [](const RecordingReader& self) { return self.header().engine; })
      .def_prop_ro("backend", [](const RecordingReader& self) { return self.header().backend; })
      .def_prop_ro("scene", [](const RecordingReader& self) { return self.header().scene; })
      .def_prop_ro("steps", &RecordingReader::steps)
      .def("write_states", [](RecordingReader& self, std::uint64_t step,
                              const Rows<Real>& positions, const Rows<Real>& orientations,
                              const Rows<Real>& velocities, const Rows<Real>& angular_velocities) {
        fill({positions, orientations, velocities, angular_velocities}, self.states(step));
      });
  module.def("recording_precision",
             [](const std::string& path) { return recording_precision(path); });
}

}  // namespace python
}  // namespace JFPX_ABI
}  // namespace jfpx
