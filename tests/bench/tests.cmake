# Benchmarks: built on demand (tests/bench/run.sh). That they run to their end is a test of tests/run.sh all, which
# builds bench_programs in preset release; the figures are none.
if(AXISD_SANITIZE)
  return()
endif()
add_executable(bench_can EXCLUDE_FROM_ALL ${CMAKE_CURRENT_LIST_DIR}/can_bench.cpp ${CMAKE_CURRENT_LIST_DIR}/can_index.cpp)
target_include_directories(bench_can PRIVATE ${CMAKE_SOURCE_DIR})
target_link_libraries(bench_can PRIVATE axisd_test_support axisd_core)
add_executable(bench_index EXCLUDE_FROM_ALL ${CMAKE_CURRENT_LIST_DIR}/index_main.cpp
                                            ${CMAKE_CURRENT_LIST_DIR}/index_virtual.cpp ${CMAKE_CURRENT_LIST_DIR}/index_wire.cpp)
target_include_directories(bench_index PRIVATE ${CMAKE_SOURCE_DIR})
target_link_libraries(bench_index PRIVATE axisd_test_support axisd_core)
add_executable(bench_bare_loop EXCLUDE_FROM_ALL ${CMAKE_CURRENT_LIST_DIR}/bare_loop.cpp)
add_executable(bench_bare_waits EXCLUDE_FROM_ALL ${CMAKE_CURRENT_LIST_DIR}/bare_waits.cpp)
add_executable(bench_modbus_loop EXCLUDE_FROM_ALL ${CMAKE_CURRENT_LIST_DIR}/modbus_loop.cpp)
target_link_libraries(bench_modbus_loop PRIVATE PkgConfig::MODBUS)
add_executable(bench_index_loop EXCLUDE_FROM_ALL ${CMAKE_CURRENT_LIST_DIR}/index_loop.cpp)
target_link_libraries(bench_index_loop PRIVATE PkgConfig::MODBUS)
foreach(counter sync allocation)
  add_library(bench_${counter}_counter MODULE EXCLUDE_FROM_ALL ${CMAKE_CURRENT_LIST_DIR}/${counter}_counter.cpp)
  target_include_directories(bench_${counter}_counter PRIVATE ${CMAKE_SOURCE_DIR})
endforeach()
add_executable(bench_untimed_line EXCLUDE_FROM_ALL ${CMAKE_CURRENT_LIST_DIR}/untimed_line.cpp)
target_include_directories(bench_untimed_line PRIVATE ${CMAKE_SOURCE_DIR})
target_link_libraries(bench_untimed_line PRIVATE axisd_simulation)

if(AXISD_GRPC)
  foreach(program rpc_client command_client index_client bare_server)
    add_executable(bench_${program} EXCLUDE_FROM_ALL ${CMAKE_CURRENT_LIST_DIR}/${program}.cpp)
    target_link_libraries(bench_${program} PRIVATE axisd_proto)
  endforeach()
  add_executable(bench_full_journal EXCLUDE_FROM_ALL ${CMAKE_CURRENT_LIST_DIR}/full_journal.cpp)
  target_include_directories(bench_full_journal PRIVATE ${CMAKE_SOURCE_DIR})
  target_link_libraries(bench_full_journal PRIVATE axisd_core)
  add_custom_target(bench_programs DEPENDS bench_can bench_index bench_bare_loop bench_bare_waits bench_modbus_loop bench_untimed_line bench_rpc_client
                                           bench_command_client bench_full_journal bench_bare_server bench_index_client
                                           bench_index_loop bench_sync_counter bench_allocation_counter axisd axisd-sim axisctl axisd-cell axisd-web)
  set(include_file ${CMAKE_CURRENT_BINARY_DIR}/bench_programs_include.cmake)
  set(text "")
  foreach(command bring-up core)
    string(APPEND text "add_test(bench.${command} $<TARGET_FILE:bench_can> ${command} 2)\n")
  endforeach()
  foreach(command index groups)
    string(APPEND text "add_test(bench.${command}_on_can $<TARGET_FILE:bench_can> ${command} 3)\n")
  endforeach()
  string(APPEND text
    "add_test(bench.virtual_rates $<TARGET_FILE:bench_index> rates --moves 3000 --axes 4 16 --baud 115200)\n"
    "add_test(bench.virtual_stops $<TARGET_FILE:bench_index> stops --stops 30 --baud 115200)\n"
    "add_test(bench.virtual_done $<TARGET_FILE:bench_index> done --moves 200 --baud 115200)\n"
    "add_test(bench.virtual_groups $<TARGET_FILE:bench_index> groups --rounds 1 --baud 115200)\n")
  add_executable(bench_queue EXCLUDE_FROM_ALL ${CMAKE_CURRENT_LIST_DIR}/queue_bench.cpp)
  target_include_directories(bench_queue PRIVATE ${CMAKE_SOURCE_DIR})
  target_link_libraries(bench_queue PRIVATE axisd_buses)
  add_dependencies(bench_programs bench_queue)
  string(APPEND text "add_test(bench.queue $<TARGET_FILE:bench_queue>)\n"
    "set_tests_properties(bench.queue PROPERTIES LABELS slow TIMEOUT 300)\n")
  string(APPEND text
    "add_test(bench.sync_in_guest ${CMAKE_SOURCE_DIR}/tests/guest/run.sh -t 200 /usr/bin/python3 -B "
    "${CMAKE_CURRENT_LIST_DIR}/can_bench.py ${CMAKE_BINARY_DIR} --rounds 1 --seconds 1 --nodes 2)\n"
    "add_test(bench.rtu /usr/bin/python3 -B ${CMAKE_CURRENT_LIST_DIR}/rtu_bench.py ${CMAKE_BINARY_DIR} --turns 1 "
    "--rounds 1 --seconds 1 --nodes 4 --baud 115200 --stops 5)\n"
    "add_test(bench.stop_all /usr/bin/python3 -B ${CMAKE_CURRENT_LIST_DIR}/stop_all_bench.py ${CMAKE_BINARY_DIR} --nodes 4 "
    "--silent 1 3 --baud 115200 --stops 2 --report-only)\n"
    "add_test(bench.index /usr/bin/python3 -B ${CMAKE_CURRENT_LIST_DIR}/index_bench.py ${CMAKE_BINARY_DIR} --axes 2 1/3 "
    "--baud 115200 --lines 2/2 --rounds 1 --seconds 1 --report-only)\n"
    "add_test(bench.rpc /usr/bin/python3 -B ${CMAKE_CURRENT_LIST_DIR}/rpc_bench.py ${CMAKE_BINARY_DIR} --rounds 1 "
    "--seconds 1)\n"
    "add_test(bench.cell /usr/bin/python3 -B ${CMAKE_CURRENT_LIST_DIR}/cell_bench.py ${CMAKE_BINARY_DIR} --rounds 1 "
    "--seconds 1)\n"
    "add_test(bench.machine /usr/bin/python3 -B ${CMAKE_CURRENT_LIST_DIR}/machine_bench.py ${CMAKE_BINARY_DIR} "
    "--rounds 1 --seconds 1 --axes 1)\n"
    "add_test(bench.admission /usr/bin/python3 -B ${CMAKE_CURRENT_LIST_DIR}/admission_bench.py ${CMAKE_BINARY_DIR} "
    "--rounds 1 --seconds 1 --axes 2 --ids 20000)\n"
    "add_test(bench.siege /usr/bin/python3 -B ${CMAKE_CURRENT_LIST_DIR}/siege_bench.py ${CMAKE_BINARY_DIR} --seconds 2 "
    "--after 1 --only nobody --only \"rapid reset\" --only \"10,000 silent connections\" --only \"SETTINGS flood\" "
    "--only \"half-open streams of 15 bytes\" --only \"half-open streams, a few each\" --report-only)\n"
    "add_test(bench.siege_kill /usr/bin/python3 -B ${CMAKE_CURRENT_LIST_DIR}/siege_bench.py ${CMAKE_BINARY_DIR} --kill 1 "
    "--only nobody --only \"rapid reset\" --only \"10,000 silent connections\" --report-only)\n"
    "add_test(bench.hang /usr/bin/python3 -B ${CMAKE_CURRENT_LIST_DIR}/hang_bench.py ${CMAKE_BINARY_DIR} --hangs 2 --axes 2 --patience 5 "
    "--report-only)\n"
    "add_test(bench.page node ${CMAKE_CURRENT_LIST_DIR}/page_bench.mjs ${CMAKE_BINARY_DIR} stop 2)\n"
    "set_tests_properties(bench.page PROPERTIES LABELS slow TIMEOUT 300)\n"
    "set_tests_properties(bench.rtu bench.stop_all bench.index bench.rpc bench.cell bench.machine bench.admission bench.siege_kill bench.hang PROPERTIES LABELS slow TIMEOUT 300 RESOURCE_LOCK port)\n"
    "set_tests_properties(bench.siege PROPERTIES LABELS slow TIMEOUT 600 RESOURCE_LOCK port)\n"
    "set_tests_properties(bench.bring-up bench.core bench.index_on_can bench.groups_on_can bench.virtual_rates bench.virtual_stops bench.virtual_done "
    "bench.virtual_groups bench.sync_in_guest PROPERTIES LABELS slow TIMEOUT 300)\n"
    "set_tests_properties(bench.sync_in_guest PROPERTIES RESOURCE_LOCK guest COST 100)\n")
  file(GENERATE OUTPUT ${include_file} CONTENT "${text}")
  set_property(DIRECTORY APPEND PROPERTY TEST_INCLUDE_FILES ${include_file})
endif()
