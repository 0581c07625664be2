# The scenarios against the built programs on vcan interfaces, in real time, in the guest. Programs with sanitizers do
# not start there: tests/run.sh takes this from preset dev, as the whole suite. All scenarios take minutes there: this
# runs those of motion; `test_conformance --vcan AXISD AXISD_SIM` without a name runs all (README.md).
if(NOT AXISD_GRPC OR AXISD_SANITIZE)
  return()
endif()
add_dependencies(test_conformance axisd axisd-sim)
file(GENERATE OUTPUT ${CMAKE_CURRENT_BINARY_DIR}/test_conformance_vcan_include.cmake CONTENT
"add_test(test_conformance.vcan_in_guest \"${CMAKE_SOURCE_DIR}/tests/guest/run.sh\" -t 280 -m 1G
  env TMPDIR=/dev/shm \"$<TARGET_FILE:test_conformance>\" --vcan \"$<TARGET_FILE:axisd>\" \"$<TARGET_FILE:axisd-sim>\" moves)
set_tests_properties(test_conformance.vcan_in_guest PROPERTIES TIMEOUT 300 LABELS slow)
")
set_property(DIRECTORY APPEND PROPERTY TEST_INCLUDE_FILES ${CMAKE_CURRENT_BINARY_DIR}/test_conformance_vcan_include.cmake)
