# Toolchain file: Windows on x86-64, cross-compiled by MinGW-w64 (with POSIX threads), with the packages that
# `scripts/setup windows` installs on Debian 12 and the libraries that cmake/mingw-packages builds from them. Programs
# of the build, among them the tests, run under Wine. Static programs need no DLL of the compiler; with BUILD_SHARED_LIBS,
# exceptions pass between libraries, which takes one run-time library for all.
set(CMAKE_SYSTEM_NAME Windows)
set(CMAKE_SYSTEM_PROCESSOR x86_64)
if(NOT CMAKE_CXX_COMPILER)
  set(CMAKE_CXX_COMPILER x86_64-w64-mingw32-g++-posix)
endif()
if(NOT CMAKE_C_COMPILER)
  set(CMAKE_C_COMPILER x86_64-w64-mingw32-gcc-posix)
endif()
set(CMAKE_RC_COMPILER x86_64-w64-mingw32-windres)
find_program(JFPX_WINE NAMES wine64 wine PATHS /usr/lib/wine)
set(CMAKE_CROSSCOMPILING_EMULATOR ${CMAKE_COMMAND} -E env WINEDEBUG=-all ${JFPX_WINE})
if(BUILD_SHARED_LIBS) # DLLs of the compiler
  set(folders "")
  foreach(library IN ITEMS libstdc++-6.dll libwinpthread-1.dll)
    execute_process(COMMAND ${CMAKE_CXX_COMPILER} -print-file-name=${library}
      OUTPUT_VARIABLE file OUTPUT_STRIP_TRAILING_WHITESPACE)
    cmake_path(GET file PARENT_PATH folder)
    string(APPEND folders "Z:${folder}\;")
  endforeach()
  list(INSERT CMAKE_CROSSCOMPILING_EMULATOR 3 "WINEPATH=${folders}")
else()
  set(CMAKE_EXE_LINKER_FLAGS_INIT -static)
endif()

set(CMAKE_CXX_COMPILER_TARGET x86_64-w64-mingw32) # of clang; g++ has one target
set(CMAKE_EXECUTABLE_SUFFIX .exe)
# Headers and libraries of this machine are not those of Windows.
if(NOT JFPX_MINGW_PACKAGES)
  set(JFPX_MINGW_PACKAGES ${CMAKE_CURRENT_LIST_DIR}/../build/mingw-packages/packages)
endif()
set(CMAKE_FIND_ROOT_PATH /usr/x86_64-w64-mingw32 ${JFPX_MINGW_PACKAGES})
set(CMAKE_FIND_ROOT_PATH_MODE_PROGRAM NEVER)
set(CMAKE_FIND_ROOT_PATH_MODE_LIBRARY ONLY)
set(CMAKE_FIND_ROOT_PATH_MODE_INCLUDE ONLY)
set(CMAKE_FIND_ROOT_PATH_MODE_PACKAGE ONLY)
set(ENV{PKG_CONFIG_LIBDIR} ${JFPX_MINGW_PACKAGES}/lib/pkgconfig)
