# Checks of the tree itself: in the presets dev and asan, one of which is in every run. -B: no __pycache__ in the tree.
if(AXISD_SANITIZE MATCHES "thread")
  return()
endif()
set(python /usr/bin/python3 -B)
set(checks ${CMAKE_SOURCE_DIR}/tests/checks)
add_test(NAME checks.layering COMMAND ${python} ${checks}/layering.py ${CMAKE_SOURCE_DIR})
add_test(NAME checks.texts COMMAND ${python} ${checks}/texts.py ${CMAKE_SOURCE_DIR})
add_test(NAME checks.documents COMMAND ${python} ${checks}/documents.py ${CMAKE_SOURCE_DIR})
add_test(NAME checks.members COMMAND ${python} ${checks}/members.py ${CMAKE_SOURCE_DIR})
add_test(NAME checks.can_fail COMMAND ${python} ${checks}/test_checks.py)
add_test(NAME checks.tidy_can_fail COMMAND ${python} ${checks}/test_tidy.py)
add_test(NAME checks.format COMMAND ${checks}/format.sh)
add_test(NAME checks.scripts COMMAND ${checks}/scripts.sh)
set(names layering texts documents members can_fail tidy_can_fail format scripts)
if(AXISD_GRPC)
  add_test(NAME checks.contract COMMAND ${checks}/contract.sh)
  add_test(NAME checks.contract_can_fail COMMAND ${python} ${checks}/test_contract.py)
  add_test(NAME checks.reference COMMAND ${python} ${checks}/test_reference.py)
  add_test(NAME checks.service COMMAND ${checks}/service.sh ${CMAKE_BINARY_DIR})
  add_test(NAME checks.hardening COMMAND ${python} ${checks}/hardening.py "${AXISD_HARDENING_PROMISES}"
           $<TARGET_FILE:axisd> $<TARGET_FILE:axisctl> $<TARGET_FILE:axisd-sim> $<TARGET_FILE:axisd-link>
           $<TARGET_FILE:axisd-web> $<TARGET_FILE:axisd-cell>)
  add_test(NAME checks.hardening_can_fail COMMAND ${python} ${checks}/test_hardening.py ${CMAKE_CXX_COMPILER})
  add_test(NAME checks.manuals COMMAND ${python} ${checks}/manuals.py
           ${CMAKE_SOURCE_DIR}/deploy/man/axisd.8=$<TARGET_FILE:axisd>
           ${CMAKE_SOURCE_DIR}/deploy/man/axisd-sim.1=$<TARGET_FILE:axisd-sim>
           ${CMAKE_SOURCE_DIR}/deploy/man/axisd-link.8=$<TARGET_FILE:axisd-link>
           ${CMAKE_SOURCE_DIR}/deploy/man/axisd-web.8=$<TARGET_FILE:axisd-web>
           ${CMAKE_SOURCE_DIR}/deploy/man/axisd-cell.8=$<TARGET_FILE:axisd-cell>
           ${CMAKE_BINARY_DIR}/api/axisctl/axisctl.1 ${CMAKE_BINARY_DIR}/api/axisctl/axisd.yaml.5)
  add_test(NAME checks.manuals_can_fail COMMAND ${python} ${checks}/test_manuals.py)
  list(APPEND names manuals manuals_can_fail contract contract_can_fail reference service hardening hardening_can_fail)
endif()
list(TRANSFORM names PREPEND checks.)
set_tests_properties(${names} PROPERTIES TIMEOUT 120 LABELS checks)
if(AXISD_GRPC)
  set_tests_properties(checks.service PROPERTIES RESOURCE_LOCK install_manifest)
endif()
# They take both cores for minutes, so they are not in `tests/run.sh quick`, and start first.
add_test(NAME checks.tidy COMMAND ${python} ${checks}/tidy.py ${CMAKE_BINARY_DIR})
add_test(NAME checks.tidy_whole COMMAND ${python} ${checks}/tidy.py ${CMAKE_BINARY_DIR} --whole)
set_tests_properties(checks.tidy checks.tidy_whole PROPERTIES TIMEOUT 1800 LABELS slow PROCESSORS 2 COST 1000)
