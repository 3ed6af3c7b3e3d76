/// Binding of recordings.
#include <jfpx/recording.hpp>

#include "python/src/bindings.hpp"
#include "python/src/world.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace python {
namespace {

/// A writer that close() discards with its unfinished file.
struct Writer {
  std::optional<RecordingWriter> writer;
  RecordingWriter& get() {
    if (!writer) throw Closed("the recording is closed");
    return *writer;
  }
};

}  // namespace

void bind_recording(nb::module_& module) {
  nb::class_<Writer>(module, "RecordingWriter")
      .def("__init__",
           [](Writer* self, const std::string& path, const PythonWorld& world) {
             new (self) Writer{RecordingWriter(
                 path, {.engine = "native", .backend = "cpu", .scene = world.scene()})};
           })
      .def("append",
           [](Writer& self, const PythonWorld& world) { self.get().append(world.get().states()); })
      .def("finish",
           [](Writer& self) {
             self.get().finish();
             self.writer.reset();
           })
      .def("is_open", [](const Writer& self) { return self.writer.has_value(); })
      .def("discard", [](Writer& self) { self.writer.reset(); });

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
