# A cell on real networks and a real etcd, in namespaces (run.sh).
if(AXISD_GRPC)
  find_program(AXISD_PYTHON NAMES python3 PATHS /usr/bin NO_DEFAULT_PATH REQUIRED)
  file(GLOB scenarios CONFIGURE_DEPENDS ${CMAKE_CURRENT_LIST_DIR}/test_*.py)
  foreach(scenario IN LISTS scenarios)
    get_filename_component(name ${scenario} NAME_WE)
    string(REGEX REPLACE "^test_" "${AXISD_TEST_PREFIX}cell." name ${name})
    add_test(NAME ${name} COMMAND ${CMAKE_CURRENT_LIST_DIR}/run.sh ${AXISD_PYTHON} -B ${scenario})
    # Nobody who answers may be called dead, so nobody is kept from answering by other tests.
    set_tests_properties(${name} PROPERTIES LABELS e2e TIMEOUT 900 PROCESSORS 2 COST 100
      ENVIRONMENT "PYTHONPATH=${CMAKE_SOURCE_DIR}/tests/e2e;AXISD=$<TARGET_FILE:axisd>;AXISD_SIM=$<TARGET_FILE:axisd-sim>;AXISCTL=$<TARGET_FILE:axisctl>;AXISD_CELL=$<TARGET_FILE:axisd-cell>;AXISD_SANITIZE=${AXISD_SANITIZE}")
  endforeach()
endif()
