# The promise of equal bits rests on each operation being rounded once. g++ and clang contract a*b+c to
# FMA when the target has it; users inline our headers (and Bullet's), so the flag against that is part of
# the usage requirements.
set(JFPX_EXACT_FLAGS $<$<COMPILE_LANG_AND_ID:CXX,GNU,Clang,AppleClang>:-ffp-contract=off>)
# It is not enough: where it vectorises alternating sums and differences of products, g++ 12 makes
# vfmaddsub of them without asking for that flag. So none of our own files may use FMA, whatever -march
# users choose; AVX-512 brings its own. Files with kernels that are chosen at run time add what they need.
set(JFPX_OWN_EXACT_FLAGS
  $<$<COMPILE_LANG_AND_ID:CXX,GNU,Clang,AppleClang>:-mno-fma;-mno-fma4;-mno-avx512f>)
