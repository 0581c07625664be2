# Scenarios with the real programs, one test per file. Debian's interpreter: its packages are of that one only.
if(AXISD_GRPC)
  find_program(AXISD_PYTHON NAMES python3 PATHS /usr/bin NO_DEFAULT_PATH REQUIRED)
  file(GLOB scenarios CONFIGURE_DEPENDS ${CMAKE_CURRENT_LIST_DIR}/test_*.py)
  foreach(scenario IN LISTS scenarios)
    get_filename_component(name ${scenario} NAME_WE)
    string(REGEX REPLACE "^test_" "${AXISD_TEST_PREFIX}e2e." name ${name})
    add_test(NAME ${name} COMMAND ${AXISD_PYTHON} -B ${scenario})
    set_tests_properties(${name} PROPERTIES LABELS e2e TIMEOUT 600
      ENVIRONMENT "AXISD=$<TARGET_FILE:axisd>;AXISD_SIM=$<TARGET_FILE:axisd-sim>;AXISCTL=$<TARGET_FILE:axisctl>")
  endforeach()
endif()
