set(system posix)
if(WIN32)
  set(system windows)
endif()
list(APPEND JFPX_SOURCES
  ${CMAKE_CURRENT_LIST_DIR}/atomic_file.cpp
  ${CMAKE_CURRENT_LIST_DIR}/build.cpp
  ${CMAKE_CURRENT_LIST_DIR}/cpu.cpp
  ${CMAKE_CURRENT_LIST_DIR}/error.cpp
  ${CMAKE_CURRENT_LIST_DIR}/file.cpp
  ${CMAKE_CURRENT_LIST_DIR}/interrupt.cpp
  ${CMAKE_CURRENT_LIST_DIR}/rotation.cpp
  ${CMAKE_CURRENT_LIST_DIR}/system_${system}.cpp
  ${CMAKE_CURRENT_LIST_DIR}/thread_pool.cpp
  ${CMAKE_CURRENT_LIST_DIR}/time_chooser.cpp)
list(APPEND JFPX_CUDA_SOURCES
  ${CMAKE_CURRENT_LIST_DIR}/cuda/cuda_try.cpp
  ${CMAKE_CURRENT_LIST_DIR}/cuda/device_buffer.cpp
  ${CMAKE_CURRENT_LIST_DIR}/cuda/mapped_memory.cpp
  ${CMAKE_CURRENT_LIST_DIR}/cuda/device_code.cu
  ${CMAKE_CURRENT_LIST_DIR}/cuda/probe.cpp)
# windows.h defines macros that are names in other sources.
set_source_files_properties(${CMAKE_CURRENT_LIST_DIR}/system_windows.cpp PROPERTIES SKIP_UNITY_BUILD_INCLUSION ON)
