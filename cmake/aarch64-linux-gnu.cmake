# Toolchain file: ARM64 Linux, with the packages that `scripts/setup arm` installs on Debian 12. Programs of the
# build, among them the tests, run under qemu. The compiler is g++; -DCMAKE_CXX_COMPILER=clang++ selects clang.
set(CMAKE_SYSTEM_NAME Linux)
set(CMAKE_SYSTEM_PROCESSOR aarch64)
if(NOT CMAKE_CXX_COMPILER)
  set(CMAKE_CXX_COMPILER aarch64-linux-gnu-g++)
endif()
set(CMAKE_CXX_COMPILER_TARGET aarch64-linux-gnu) # of clang; g++ has one target
# A processor with all extensions that qemu emulates.
set(CMAKE_CROSSCOMPILING_EMULATOR qemu-aarch64-static -cpu max)
# The libraries of the foreign architecture are in Debian's multiarch folders.
set(ENV{PKG_CONFIG_LIBDIR} /usr/lib/aarch64-linux-gnu/pkgconfig:/usr/share/pkgconfig)
