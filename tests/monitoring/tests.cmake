# promtool and Prometheus itself, of Debian: what deploy/ has for them, without the daemon and fed by it.
if(AXISD_GRPC AND NOT AXISD_SANITIZE)
  find_program(AXISD_PYTHON NAMES python3 PATHS /usr/bin NO_DEFAULT_PATH REQUIRED)
  add_test(NAME monitoring.rules COMMAND ${AXISD_PYTHON} -B ${CMAKE_CURRENT_LIST_DIR}/test_rules.py)
  add_test(NAME monitoring.prometheus COMMAND ${AXISD_PYTHON} -B ${CMAKE_CURRENT_LIST_DIR}/test_prometheus.py)
  set_tests_properties(monitoring.rules PROPERTIES LABELS checks TIMEOUT 120)
  set_tests_properties(monitoring.prometheus PROPERTIES LABELS e2e TIMEOUT 300
    ENVIRONMENT "PYTHONPATH=${CMAKE_SOURCE_DIR}/tests/e2e;AXISD=$<TARGET_FILE:axisd>;AXISD_SIM=$<TARGET_FILE:axisd-sim>;AXISCTL=$<TARGET_FILE:axisctl>")
endif()
