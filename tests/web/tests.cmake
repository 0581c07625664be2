# axisd-web: units, and the program in front of a real daemon.
if(AXISD_GRPC)
  file(GLOB sources CONFIGURE_DEPENDS unit/web/*.cpp)
  axisd_test(test_web SOURCES ${sources} LINK axisd_web)

  find_program(AXISD_PYTHON NAMES python3 PATHS /usr/bin NO_DEFAULT_PATH REQUIRED)
  foreach(scenario IN ITEMS gateway lane machines)
    set(name ${AXISD_TEST_PREFIX}web.${scenario})
    add_test(NAME ${name} COMMAND ${AXISD_PYTHON} -B ${CMAKE_CURRENT_LIST_DIR}/test_${scenario}.py)
    set_tests_properties(${name} PROPERTIES LABELS e2e TIMEOUT 600
      ENVIRONMENT "PYTHONPATH=${CMAKE_SOURCE_DIR}/tests/e2e;AXISD=$<TARGET_FILE:axisd>;AXISD_SIM=$<TARGET_FILE:axisd-sim>;AXISCTL=$<TARGET_FILE:axisctl>;AXISD_WEB=$<TARGET_FILE:axisd-web>;AXISD_SANITIZE=${AXISD_SANITIZE}")
  endforeach()
endif()
