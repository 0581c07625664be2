# SocketCAN, in a guest whose kernel has it; one guest for all of these tests. AddressSanitizer and ThreadSanitizer
# programs do not start there, so that this program is built without them, from the sources, in every preset but tsan:
# one preset is enough.
if(AXISD_SANITIZE MATCHES "thread")
  return()
endif()
file(GLOB sources CONFIGURE_DEPENDS can/*.cpp ${CMAKE_SOURCE_DIR}/buses/*.cpp ${CMAKE_SOURCE_DIR}/buses/can/*.cpp)
# What knows both kinds of bus would need all of both.
list(FILTER sources EXCLUDE REGEX "/(budget_[a-z]+|bus_load|frame_ring|traced_frame)\\.cpp$")
add_executable(test_socketcan ${sources})
target_include_directories(test_socketcan PRIVATE ${CMAKE_SOURCE_DIR})
target_compile_options(test_socketcan PRIVATE -fno-sanitize=address)
target_link_options(test_socketcan PRIVATE -fno-sanitize=address)
target_link_libraries(test_socketcan PRIVATE spdlog::spdlog Threads::Threads GTest::gmock GTest::gtest_main)
add_test(NAME ${AXISD_TEST_PREFIX}can.socketcan_in_guest
         COMMAND ${CMAKE_SOURCE_DIR}/tests/guest/run.sh -t 60 $<TARGET_FILE:test_socketcan>)
set_tests_properties(${AXISD_TEST_PREFIX}can.socketcan_in_guest PROPERTIES TIMEOUT 120)
