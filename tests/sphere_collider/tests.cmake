# The contract of SphereCollider (sphere_collider_test.cpp), once for each backend.
jfpx_add_test(sphere_collider_cpu_test
  SOURCES
    sphere_collider/sphere_collider_test.cpp
    sphere_collider/cpu/cpu_cases.cpp
    sphere_collider/backend_test.cpp
    sphere_collider/contact_list_test.cpp
    sphere_collider/interrupt_test.cpp
    sphere_collider/nearest_test.cpp
    sphere_collider/neighbor_systems_test.cpp
    sphere_collider/neighbors_test.cpp
    sphere_collider/periodic_test.cpp
    sphere_collider/cpu/sphere_collider_cpu_test.cpp
    support/sphere_fixtures.cpp)
jfpx_add_test(automatic_contract_test
  SOURCES
    sphere_collider/automatic_cases.cpp
    sphere_collider/sphere_collider_test.cpp
    support/sphere_fixtures.cpp)

set(bullet_takeover "")
set(bullet_library "")
if(JFPX_HAS_BULLET)
  set(bullet_takeover sphere_collider/bullet_takeover_test.cpp)
  set(bullet_library jfpx_bullet)
endif()
jfpx_add_test(automatic_test THESIS INTERNAL
  SOURCES
    sphere_collider/automatic_sphere_collider_test.cpp
    sphere_collider/cost_model_test.cpp
    sphere_collider/switching_test.cpp
    ${bullet_takeover}
    support/sphere_fixtures.cpp
  LINK ${bullet_library} nlohmann_json::nlohmann_json)
foreach(target IN ITEMS sphere_collider_cpu_test sphere_collider_cpu_test_f64)
  target_compile_definitions(${target} PRIVATE JFPX_HAS_CUDA=$<BOOL:${JFPX_HAS_CUDA}>)
endforeach()
# A separate program, because it replaces operator new.
jfpx_add_test(sphere_collider_allocation_test
  SOURCES
    sphere_collider/cpu/allocation_test.cpp
    support/sphere_fixtures.cpp)

if(JFPX_HAS_CUDA)
  jfpx_add_test(sphere_collider_cuda_test
    SOURCES
      sphere_collider/cuda/cuda_cases.cpp
      sphere_collider/cuda/filter_test.cpp
      sphere_collider/sphere_collider_test.cpp
      support/sphere_fixtures.cpp)
  jfpx_add_test(cuda_test
    SOURCES
      contact_solver/group_solver_test.cpp
      sphere_collider/cuda/array_collider_test.cpp
      sphere_collider/cuda/cuda_fault_test.cpp
      sphere_collider/cuda/cuda_few_test.cpp
      sphere_collider/cuda/cuda_huge_test.cpp
      sphere_collider/cuda/cuda_test.cpp
      sphere_collider/cuda/periodic_arrays_test.cpp
      support/sphere_fixtures.cpp
    LINK jfpx_cuda CUDA::cudart_static)
endif()
