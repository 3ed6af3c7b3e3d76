set(bullet_takeover "")
set(bullet_library "")
if(JFPX_HAS_BULLET)
  set(bullet_takeover automatic/bullet_takeover_test.cpp)
  set(bullet_library jfpx_bullet)
endif()
jfpx_add_test(automatic_test INTERNAL
  SOURCES
    automatic/automatic_sphere_collider_test.cpp
    automatic/cost_chooser_test.cpp
    automatic/cost_model_test.cpp
    automatic/switching_test.cpp
    ${bullet_takeover}
    support/sphere_fixtures.cpp
  LINK ${bullet_library} nlohmann_json::nlohmann_json)
jfpx_add_test(automatic_contract_test
  SOURCES
    automatic/sphere_collider_cases.cpp
    sphere_collider_test.cpp
    support/sphere_fixtures.cpp)
