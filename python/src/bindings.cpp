/// The bindings of one precision, and the translation of exceptions to the classes of jfpx._errors.
#include "python/src/bindings.hpp"

#include <jfpx/thesis/worst_first.hpp>

#include <new>

#if defined(JFPX_DOUBLE_PRECISION)
#define JFPX_BIND bind_jfpx_f64
#else
#define JFPX_BIND bind_jfpx_f32
#endif

void JFPX_BIND(nanobind::module_& module);

namespace jfpx {
inline namespace JFPX_ABI {
namespace python {
namespace {

/// Sets the exception jfpx._errors.NAME.
void set_error(const char* name, const char* message) {
  const nb::object type = nb::module_::import_("jfpx._errors").attr(name);
  PyErr_SetString(type.ptr(), message);
}

void translate(const std::exception_ptr& exception, void* /*payload*/) {
  try {
    std::rethrow_exception(exception);
  } catch (const InvalidScene& e) {
    set_error("InvalidScene", e.what());
  } catch (const InvalidSnapshot& e) {
    set_error("InvalidSnapshot", e.what());
  } catch (const InvalidArgument& e) {
    set_error("InvalidArgument", e.what());
  } catch (const BackendUnavailable& e) {
    set_error("BackendUnavailable", e.what());
  } catch (const OutOfMemory& e) {
    set_error("OutOfMemory", e.what());
  } catch (const DeviceError& e) {
    set_error("DeviceError", e.what());
  } catch (const FileError& e) {
    set_error("FileError", e.what());
  } catch (const ConcurrentUse& e) {
    set_error("ConcurrentUse", e.what());
  } catch (const Closed& e) {
    set_error("Closed", e.what());
  } catch (const Error& e) {
    set_error("Error", e.what());
  } catch (const std::bad_alloc&) {
    set_error("OutOfMemory", "host memory is exhausted");
  }
}

}  // namespace

void register_exceptions() { nb::register_exception_translator(translate); }

}  // namespace python
}  // namespace JFPX_ABI
}  // namespace jfpx

void JFPX_BIND(nanobind::module_& module) {
  jfpx::thesis::enable();
  jfpx::python::register_exceptions();
  jfpx::python::bind_collider(module);
  jfpx::python::bind_nearest(module);
  jfpx::python::bind_neighbors(module);
#if JFPX_HAS_CUDA
  jfpx::python::bind_device_collider(module);
#endif
  jfpx::python::bind_scene(module);
  jfpx::python::bind_world(module);
  jfpx::python::bind_recording(module);
}
