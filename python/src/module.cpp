/// The extension module `jfpx._core`: a submodule for each precision.
#include <nanobind/nanobind.h>

void bind_jfpx_f32(nanobind::module_& module);
void bind_jfpx_f64(nanobind::module_& module);

NB_MODULE(_core, module) {
  module.doc() = "Bindings of the C++ library. The package jfpx is their interface.";
  nanobind::module_ f32 = module.def_submodule("f32", "single precision");
  bind_jfpx_f32(f32);
  nanobind::module_ f64 = module.def_submodule("f64", "double precision");
  bind_jfpx_f64(f64);
}
