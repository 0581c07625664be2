# Benchmarks: built on demand (tests/bench/run.sh), never a part of the tests.
if(AXISD_SANITIZE)
  return()
endif()
add_executable(bench_can EXCLUDE_FROM_ALL ${CMAKE_CURRENT_LIST_DIR}/can_bench.cpp)
target_include_directories(bench_can PRIVATE ${CMAKE_SOURCE_DIR})
target_link_libraries(bench_can PRIVATE axisd_test_support axisd_core)
