jfpx_add_test(bullet_contract_test SOURCES
  bullet/contact_callbacks_test.cpp
  bullet/replaced_test.cpp
  bullet/situations_test.cpp
  bullet/stats_test.cpp
  LINK jfpx_bullet)
jfpx_add_test(bullet_verify_test SOURCES
  bullet/scene_world_test.cpp
  bullet/verify_test.cpp
  LINK jfpx_bullet)
jfpx_add_test(bullet_trajectory_test SOURCES
  bullet/trajectory_test.cpp
  LINK jfpx_bullet)
set(random_worlds
  bullet/live_random_world.cpp
  bullet/random_world.cpp
  bullet/random_world_globals.cpp
  bullet/random_world_run.cpp)
jfpx_add_test(bullet_random_worlds_test SOURCES
  ${random_worlds}
  bullet/random_worlds_test.cpp
  LINK jfpx_bullet)
jfpx_add_test(bullet_algorithm_test SOURCES
  ${random_worlds}
  bullet/algorithm_test.cpp
  LINK jfpx_bullet)
