# Bit-exact results require that each operation is rounded once. g++ and clang contract a*b+c to FMA if the
# target supports it. Users inline the headers of jfpx and Bullet, so the flag that disables contraction is a
# usage requirement.
set(JFPX_EXACT_FLAGS $<$<COMPILE_LANG_AND_ID:CXX,GNU,Clang,AppleClang>:-ffp-contract=off>)
# The flag is not sufficient: g++ 12 vectorises alternating sums and differences of products to vfmaddsub
# regardless of it. Therefore FMA, and AVX-512, which includes FMA, are disabled for all files of jfpx, for
# any -march that users choose. Files with kernels that are selected at run time enable what they need.
set(JFPX_OWN_EXACT_FLAGS
  $<$<COMPILE_LANG_AND_ID:CXX,GNU,Clang,AppleClang>:-mno-fma;-mno-fma4;-mno-avx512f>)
