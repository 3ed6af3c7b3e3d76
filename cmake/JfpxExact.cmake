# Compiler flags that keep the bits, and the processors that are supported.
string(TOLOWER "${CMAKE_SYSTEM_PROCESSOR}" JFPX_PROCESSOR)
if(JFPX_PROCESSOR MATCHES "^(x86_64|amd64)$")
  set(JFPX_PROCESSOR x86_64)
elseif(JFPX_PROCESSOR MATCHES "^(aarch64|arm64)$")
  set(JFPX_PROCESSOR aarch64)
else()
  message(FATAL_ERROR "The processor is \"${CMAKE_SYSTEM_PROCESSOR}\"; jfpx supports x86_64 and aarch64.")
endif()

# Bit-exact results require that each operation is rounded once. g++ and clang contract a*b+c to FMA if the
# target supports it, which every ARM64 processor does. Users inline the headers of jfpx and Bullet, so the
# flag that disables contraction is a usage requirement.
set(JFPX_EXACT_FLAGS $<$<COMPILE_LANG_AND_ID:CXX,GNU,Clang,AppleClang>:-ffp-contract=off>)
# On x86-64 the flag is not sufficient: g++ 12 vectorises alternating sums and differences of products to
# vfmaddsub regardless of it. Therefore FMA, and AVX-512, which includes FMA, are disabled for all files of
# jfpx, for any -march that users choose. Files with kernels that are selected at run time enable what they
# need. ARM64 has no option without fused instructions; scripts/check arm searches the binaries for them.
set(JFPX_OWN_EXACT_FLAGS "")
if(JFPX_PROCESSOR STREQUAL "x86_64")
  set(JFPX_OWN_EXACT_FLAGS
    $<$<COMPILE_LANG_AND_ID:CXX,GNU,Clang,AppleClang>:-mno-fma;-mno-fma4;-mno-avx512f>)
endif()
