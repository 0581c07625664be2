# promtool and Prometheus itself, of Debian: what deploy/ has for them, without the daemon and fed by it.
if(AXISD_GRPC)
  find_program(AXISD_PYTHON NAMES python3 PATHS /usr/bin NO_DEFAULT_PATH REQUIRED)
  set(rules ${AXISD_TEST_PREFIX}monitoring.rules)
  set(prometheus ${AXISD_TEST_PREFIX}monitoring.prometheus)
  add_test(NAME ${rules} COMMAND ${AXISD_PYTHON} -B ${CMAKE_CURRENT_LIST_DIR}/test_rules.py)
  add_test(NAME ${prometheus} COMMAND ${AXISD_PYTHON} -B ${CMAKE_CURRENT_LIST_DIR}/test_prometheus.py)
  set_tests_properties(${rules} PROPERTIES LABELS checks TIMEOUT 120)
  set_tests_properties(${prometheus} PROPERTIES LABELS e2e TIMEOUT 600
    ENVIRONMENT "PYTHONPATH=${CMAKE_SOURCE_DIR}/tests/e2e;AXISD=$<TARGET_FILE:axisd>;AXISD_SIM=$<TARGET_FILE:axisd-sim>;AXISCTL=$<TARGET_FILE:axisctl>;AXISD_SANITIZE=${AXISD_SANITIZE}")
endif()
