# Decides whether the CUDA backend is built, and sets JFPX_HAS_CUDA. The runtime is linked statically, so that
# a program with the backend starts on a machine without a driver and can report it.
set(JFPX_HAS_CUDA OFF)
if(JFPX_CUDA STREQUAL "OFF")
  jfpx_summary(cuda off "JFPX_CUDA=OFF")
  return()
endif()

if(NOT DEFINED CMAKE_CUDA_ARCHITECTURES AND NOT DEFINED ENV{CUDAARCHS})
  # Machine code for Hopper, and PTX that the driver compiles for Turing and newer GPUs. As a subproject, only
  # for the targets of jfpx.
  set(CMAKE_CUDA_ARCHITECTURES "75-virtual;90")
  if(PROJECT_IS_TOP_LEVEL)
    set(CMAKE_CUDA_ARCHITECTURES "75-virtual;90" CACHE STRING "CUDA architectures")
  endif()
endif()
# Continues without the backend, unless JFPX_CUDA=ON. The next configuration searches again.
macro(jfpx_without_cuda why remedy)
  unset(CMAKE_CUDA_COMPILER CACHE)
  if(JFPX_CUDA STREQUAL "ON")
    message(FATAL_ERROR "JFPX_CUDA=ON, but ${why}. ${remedy}, or configure with -DJFPX_CUDA=OFF.")
  endif()
  jfpx_summary(cuda off "${why}")
  return()
endmacro()
include(CheckLanguage)
check_language(CUDA)
if(NOT CMAKE_CUDA_COMPILER)
  jfpx_without_cuda("no CUDA compiler was found that works: see CMakeFiles/CMakeError.log"
    "Put nvcc on PATH, set CUDACXX, give it a host compiler that it takes by CUDAHOSTCXX")
endif()
# Checked before CMake tests the compiler, because an old one does not support the architectures.
execute_process(COMMAND ${CMAKE_CUDA_COMPILER} --version OUTPUT_VARIABLE output ERROR_QUIET)
if(NOT output MATCHES "release ([0-9.]+)")
  jfpx_without_cuda("${CMAKE_CUDA_COMPILER} is not nvcc" "Set CUDACXX to nvcc")
elseif(CMAKE_MATCH_1 VERSION_LESS 12.3)
  jfpx_without_cuda("nvcc is ${CMAKE_MATCH_1}, and 12.3 or newer is needed" "Set CUDACXX to a newer one")
endif()

enable_language(CUDA)
find_package(CUDAToolkit REQUIRED)
set(JFPX_HAS_CUDA ON)
# CMake 3.25 does not support CUDA_STANDARD 20 (it would decay to 17), so the flag is set explicitly.
# --fmad=false: nvcc must round each operation once, as the host compilers do.
# --expt-relaxed-constexpr: device code may call std::numeric_limits and jfpx's constexpr functions.
target_compile_options(jfpx_build_flags INTERFACE
  "$<$<COMPILE_LANGUAGE:CUDA>:-std=c++20;--fmad=false;--expt-relaxed-constexpr;--Wreorder;-Xcompiler=-Wall;-Xcompiler=-Wextra;-Xcompiler=-Wconversion;-Xcompiler=-Wshadow;-Xcompiler=-ffp-contract=off>"
  "$<$<AND:$<COMPILE_LANGUAGE:CUDA>,$<BOOL:${JFPX_WERROR}>>:-Werror=all-warnings;-Xcompiler=-Werror>")
string(REPLACE ";" ", " architectures "${CMAKE_CUDA_ARCHITECTURES}")
jfpx_summary(cuda on "nvcc ${CMAKE_CUDA_COMPILER_VERSION}, architectures ${architectures}")
