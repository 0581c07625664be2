# Scenarios with the real programs, one test per file. Debian's interpreter: its packages are of that one only.
if(AXISD_GRPC)
  find_program(AXISD_PYTHON NAMES python3 PATHS /usr/bin NO_DEFAULT_PATH REQUIRED)
  file(GLOB scenarios CONFIGURE_DEPENDS ${CMAKE_CURRENT_LIST_DIR}/test_*.py)
  foreach(scenario IN LISTS scenarios)
    get_filename_component(name ${scenario} NAME_WE)
    string(REGEX REPLACE "^test_" "${AXISD_TEST_PREFIX}e2e." name ${name})
    add_test(NAME ${name} COMMAND ${AXISD_PYTHON} -B ${scenario})
    set_tests_properties(${name} PROPERTIES LABELS e2e TIMEOUT 600
      ENVIRONMENT "AXISD=$<TARGET_FILE:axisd>;AXISD_SIM=$<TARGET_FILE:axisd-sim>;AXISCTL=$<TARGET_FILE:axisctl>;AXISD_SANITIZE=${AXISD_SANITIZE}")
  endforeach()
endif()

# On SocketCAN, in guests whose kernel has it. AddressSanitizer programs do not start there, so these run the programs of
# a build without: tests/run.sh builds can_scenarios in preset release whatever else it runs. Begun
# early; a guest's time is its own, so that nobody in it is late.
if(AXISD_GRPC AND NOT AXISD_SANITIZE)
  add_custom_target(can_scenarios DEPENDS axisd axisd-sim axisctl axisd-link)
  file(GLOB scenarios CONFIGURE_DEPENDS ${CMAKE_CURRENT_LIST_DIR}/can/test_*.py)
  set(include_file ${CMAKE_CURRENT_BINARY_DIR}/can_scenarios_include.cmake)
  set(text "")
  function(append_can_scenario name)  # ARGN: what Python runs
    string(JOIN " " arguments ${ARGN})
    string(APPEND text "add_test(${name} ${CMAKE_SOURCE_DIR}/tests/guest/run.sh -v -t 300 ${AXISD_PYTHON} -B ${arguments})\n"
      "set_tests_properties(${name} PROPERTIES LABELS e2e TIMEOUT 360 COST 100)\n"
      "set_tests_properties(${name} PROPERTIES ENVIRONMENT \"PYTHONPATH=${CMAKE_CURRENT_LIST_DIR};"
      "AXISD=$<TARGET_FILE:axisd>;AXISD_SIM=$<TARGET_FILE:axisd-sim>;AXISCTL=$<TARGET_FILE:axisctl>;"
      "AXISD_LINK=$<TARGET_FILE:axisd-link>\")\n")
    set(text "${text}" PARENT_SCOPE)
  endfunction()
  foreach(scenario IN LISTS scenarios)
    get_filename_component(name ${scenario} NAME_WE)
    string(REGEX REPLACE "^test_" "can.e2e." name ${name})
    if(name STREQUAL "can.e2e.foreign_slaves")  # a guest for each: they take their time
      foreach(case maxon nanotec elmo faulhaber trinamic never_seen_before)
        append_can_scenario(${name}.${case} ${scenario} ForeignSlaves.test_${case})
      endforeach()
    else()
      append_can_scenario(${name} ${scenario})
    endif()
  endforeach()
  file(GENERATE OUTPUT ${include_file} CONTENT "${text}")
  set_property(DIRECTORY APPEND PROPERTY TEST_INCLUDE_FILES ${include_file})
endif()
