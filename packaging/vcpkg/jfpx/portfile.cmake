# The port is inside the sources that it builds.
get_filename_component(SOURCE_PATH "${CMAKE_CURRENT_LIST_DIR}/../../.." ABSOLUTE)

set(cuda -DJFPX_CUDA=OFF)
if("cuda" IN_LIST FEATURES)
  vcpkg_find_cuda(OUT_CUDA_TOOLKIT_ROOT cuda_root) # defined by vcpkg's port cuda; sets NVCC
  set(cuda -DJFPX_CUDA=ON "-DCMAKE_CUDA_COMPILER=${NVCC}" "-DCUDAToolkit_ROOT=${cuda_root}")
endif()
set(bullet -DJFPX_BULLET=OFF)
if("bullet" IN_LIST FEATURES)
  vcpkg_find_acquire_program(PKGCONFIG) # jfpx finds Bullet by pkg-config
  set(bullet -DJFPX_BULLET=ON -DJFPX_PRECISIONS=float "-DPKG_CONFIG_EXECUTABLE=${PKGCONFIG}")
endif()
vcpkg_cmake_configure(
  SOURCE_PATH "${SOURCE_PATH}"
  OPTIONS ${cuda} ${bullet} -DJFPX_MPI=OFF -DJFPX_VIEWER=OFF -DJFPX_TOOL=OFF -DJFPX_EXAMPLES=OFF -DJFPX_TESTS=OFF)
vcpkg_cmake_install()
vcpkg_cmake_config_fixup(CONFIG_PATH lib/cmake/jfpx)
vcpkg_fixup_pkgconfig()
file(REMOVE_RECURSE "${CURRENT_PACKAGES_DIR}/debug/include" "${CURRENT_PACKAGES_DIR}/debug/share")
vcpkg_install_copyright(FILE_LIST "${SOURCE_PATH}/LICENSE")
