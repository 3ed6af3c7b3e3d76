# Decides whether the CUDA backend is built, and sets JFPX_HAS_CUDA. The runtime is linked statically, so that
# a program with the backend starts on a machine without a driver and can report it.
set(JFPX_HAS_CUDA OFF)
if(JFPX_CUDA STREQUAL "OFF")
  jfpx_without(cuda "JFPX_CUDA=OFF")
endif()

# The next configuration searches again.
macro(jfpx_without_cuda why remedy)
  unset(CMAKE_CUDA_COMPILER CACHE)
  jfpx_without(cuda "${why}" "${remedy}, or configure with -DJFPX_CUDA=OFF.")
endmacro()
include(CheckLanguage)
check_language(CUDA)
set(jfpx_nvcc "${CMAKE_CUDA_COMPILER}")
if(NOT jfpx_nvcc)
  if("$ENV{CUDACXX}" STREQUAL "")
    find_program(jfpx_nvcc NAMES nvcc PATHS ENV CUDA_PATH PATH_SUFFIXES bin NO_CACHE)
  else()
    get_filename_component(jfpx_nvcc "$ENV{CUDACXX}" PROGRAM)
  endif()
endif()
if(NOT jfpx_nvcc)
  jfpx_without_cuda("nvcc was not found" "Put nvcc 12.3 or newer on PATH, or name it by CUDACXX")
endif()
# Checked before CMake tests the compiler, because an old one does not support the architectures.
execute_process(COMMAND ${jfpx_nvcc} --version OUTPUT_VARIABLE output ERROR_QUIET)
if(NOT output MATCHES "release ([0-9.]+)")
  jfpx_without_cuda("${jfpx_nvcc} is not nvcc" "Set CUDACXX to nvcc")
elseif(CMAKE_MATCH_1 VERSION_LESS 12.3)
  jfpx_without_cuda("nvcc is ${CMAKE_MATCH_1}, and 12.3 or newer is needed" "Set CUDACXX to a newer one")
elseif(NOT CMAKE_CUDA_COMPILER)
  set(log CMakeError.log)
  if(CMAKE_VERSION VERSION_GREATER_EQUAL 3.26)
    set(log CMakeConfigureLog.yaml)
  endif()
  jfpx_without_cuda("${jfpx_nvcc} does not compile: see CMakeFiles/${log}" "Give it a host compiler that it takes by CUDAHOSTCXX")
endif()

# Sets `result` to the architectures of the GPUs of this machine; empty if there is none, or if nvcc or jfpx does not
# support one of them.
function(jfpx_native_architectures result)
  set(${result} "" PARENT_SCOPE)
  execute_process(COMMAND nvidia-smi --query-gpu=compute_cap --format=csv,noheader
    OUTPUT_VARIABLE capabilities OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET RESULT_VARIABLE status)
  execute_process(COMMAND ${CMAKE_CUDA_COMPILER} --list-gpu-arch OUTPUT_VARIABLE supported ERROR_QUIET)
  if(NOT status EQUAL 0 OR NOT capabilities MATCHES "^[0-9.\n]+$")
    return()
  endif()
  string(REPLACE "\n" ";" capabilities "${capabilities}")
  set(architectures "")
  foreach(capability IN LISTS capabilities)
    string(REPLACE "." "" number "${capability}")
    if(number LESS 75 OR NOT supported MATCHES "compute_${number}\n")
      return()
    endif()
    list(APPEND architectures ${number}-real)
  endforeach()
  list(REMOVE_DUPLICATES architectures)
  set(${result} "${architectures}" PARENT_SCOPE)
endfunction()
if(NOT DEFINED CMAKE_CUDA_ARCHITECTURES AND NOT DEFINED ENV{CUDAARCHS})
  # Machine code for Hopper, and PTX that the driver compiles for Turing and newer GPUs. pip compiles for the GPUs of
  # this machine, which takes less time. As a subproject, only for the targets of jfpx.
  set(architectures "")
  if(SKBUILD)
    jfpx_native_architectures(architectures)
  endif()
  if(NOT architectures)
    set(architectures "75-virtual;90")
  endif()
  set(CMAKE_CUDA_ARCHITECTURES "${architectures}")
  if(PROJECT_IS_TOP_LEVEL)
    set(CMAKE_CUDA_ARCHITECTURES "${architectures}" CACHE STRING "CUDA architectures")
  endif()
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
jfpx_summary(cuda on "nvcc ${CMAKE_CUDA_COMPILER_VERSION}, architectures ${architectures}, minutes less to build with JFPX_CUDA=OFF")
