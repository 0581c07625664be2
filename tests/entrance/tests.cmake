# axisd-cell: units, and the program in front of real daemons, with a real etcd.
if(AXISD_GRPC)
  file(GLOB sources CONFIGURE_DEPENDS unit/api/cell/*.cpp)
  axisd_test(test_cell SOURCES ${sources} LINK axisd_cell)

  find_program(AXISD_PYTHON NAMES python3 PATHS /usr/bin NO_DEFAULT_PATH REQUIRED)
  file(GLOB scenarios CONFIGURE_DEPENDS ${CMAKE_CURRENT_LIST_DIR}/test_*.py)
  foreach(scenario IN LISTS scenarios)
    get_filename_component(name ${scenario} NAME_WE)
    string(REGEX REPLACE "^test_" "${AXISD_TEST_PREFIX}entrance." name ${name})
    add_test(NAME ${name} COMMAND ${AXISD_PYTHON} -B ${scenario})
    set_tests_properties(${name} PROPERTIES LABELS e2e TIMEOUT 600
      ENVIRONMENT "PYTHONPATH=${CMAKE_SOURCE_DIR}/tests/e2e;AXISD=$<TARGET_FILE:axisd>;AXISD_SIM=$<TARGET_FILE:axisd-sim>;AXISCTL=$<TARGET_FILE:axisctl>;AXISD_CELL=$<TARGET_FILE:axisd-cell>;AXISD_SANITIZE=${AXISD_SANITIZE}")
    # Its machines stop where nobody renews them for 500 ms: other tests must not be what holds the renewals up.
    if(scenario MATCHES "test_group_moves")
      set_tests_properties(${name} PROPERTIES RUN_SERIAL ON)
    endif()
  endforeach()
endif()
