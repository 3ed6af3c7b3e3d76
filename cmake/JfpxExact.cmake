# Compiler flags that keep the bits, and the processors that are supported.
string(TOLOWER "${CMAKE_SYSTEM_PROCESSOR}" JFPX_PROCESSOR)
if(JFPX_PROCESSOR MATCHES "^(x86_64|amd64)$")
  set(JFPX_PROCESSOR x86_64)
elseif(JFPX_PROCESSOR MATCHES "^(aarch64|arm64)$")
  set(JFPX_PROCESSOR aarch64)
else()
  message(FATAL_ERROR "The processor is \"${CMAKE_SYSTEM_PROCESSOR}\"; jfpx supports x86_64 and aarch64.")
endif()
if(CMAKE_SIZEOF_VOID_P EQUAL 4) # x86 computes in the x87 unit there, which rounds to other values
  message(FATAL_ERROR "The compiler builds programs of 32 bits; jfpx takes 64.")
endif()

# Bit-exact results require that each operation is rounded once. g++ and clang contract a*b+c to FMA if the
# target supports it, which every ARM64 processor does. Users inline the headers of jfpx and Bullet, so the
# flag that disables contraction is a usage requirement.
set(JFPX_EXACT_FLAGS $<$<COMPILE_LANG_AND_ID:CXX,GNU,Clang,AppleClang>:-ffp-contract=off>)
# Files with kernels that are selected at run time enable the instructions that they need.
set(JFPX_AVX2_FLAGS -mavx2 -mpopcnt)
set(JFPX_AVX512_FLAGS -mavx512f -mavx512bw -mavx512dq -mavx512vl -mpopcnt)
if(MSVC) # clang-cl; programs that link jfpx may be compiled by cl
  if(CMAKE_CXX_COMPILER_ID STREQUAL "MSVC")
    message(FATAL_ERROR "The compiler is cl, which has no vector types: build jfpx with clang-cl, which Visual Studio "
      "includes (cmake -T ClangCL). Programs that link jfpx may be compiled by cl.")
  endif()
  # cl contracts with /fp:precise before Visual Studio 2022 only, and then for AVX2 only.
  set(JFPX_EXACT_FLAGS $<$<COMPILE_LANGUAGE:CXX>:/fp:precise> $<$<COMPILE_LANG_AND_ID:CXX,Clang>:/clang:-ffp-contract=off>)
  set(JFPX_AVX2_FLAGS /arch:AVX2)
  set(JFPX_AVX512_FLAGS /arch:AVX512)
endif()
# On x86-64 the flag is not sufficient: g++ 12 vectorises alternating sums and differences of products to
# vfmaddsub regardless of it. Therefore FMA, and AVX-512, which includes FMA, are disabled for all files of
# jfpx, for any -march that users choose. ARM64 has no option without fused instructions; scripts/check arm
# searches the binaries for them.
set(JFPX_OWN_EXACT_FLAGS "")
if(JFPX_PROCESSOR STREQUAL "x86_64" AND NOT MSVC)
  set(JFPX_OWN_EXACT_FLAGS
    $<$<COMPILE_LANG_AND_ID:CXX,GNU,Clang,AppleClang>:-mno-fma;-mno-fma4;-mno-avx512f>)
endif()
# On Windows, g++ aligns no variable on the stack to more than 16 bytes, but accesses vectors of 32 and 64 bytes there by
# instructions that require their alignment (GCC bug 54412). The assembler replaces these instructions.
if(MINGW)
  list(APPEND JFPX_OWN_EXACT_FLAGS $<$<COMPILE_LANG_AND_ID:CXX,GNU>:-Wa,-muse-unaligned-vector-move>)
endif()
