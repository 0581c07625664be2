# The scenarios against the built programs on a vcan interface, in guests with a time of their own, two of which fill this
# computer. Programs with sanitizers do not start there: tests/run.sh takes this from preset release. All of it takes
# half an hour of CPU time: tests/guest/run.sh -v -t 7200 -m 1G env TMPDIR=/dev/shm test_conformance --vcan AXISD AXISD_SIM
if(NOT AXISD_GRPC OR AXISD_SANITIZE)
  return()
endif()
add_dependencies(test_conformance axisd axisd-sim)
set(parts 8)
set(text "")
foreach(part RANGE 1 ${parts})
  string(APPEND text "add_test(test_conformance.vcan_in_guest_${part} \"${CMAKE_SOURCE_DIR}/tests/guest/run.sh\" -v -t 900 -m 1G\n"
    "  env TMPDIR=/dev/shm \"$<TARGET_FILE:test_conformance>\" --vcan-sample \"$<TARGET_FILE:axisd>\" \"$<TARGET_FILE:axisd-sim>\" ${part} ${parts})\n"
    "set_tests_properties(test_conformance.vcan_in_guest_${part} PROPERTIES TIMEOUT 960 LABELS slow COST 500)\n")
endforeach()
file(GENERATE OUTPUT ${CMAKE_CURRENT_BINARY_DIR}/test_conformance_vcan_include.cmake CONTENT "${text}")
set_property(DIRECTORY APPEND PROPERTY TEST_INCLUDE_FILES ${CMAKE_CURRENT_BINARY_DIR}/test_conformance_vcan_include.cmake)
