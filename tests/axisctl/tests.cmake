# axisctl and the Python client need gRPC on both sides.
if(AXISD_GRPC)
  file(GLOB sources CONFIGURE_DEPENDS unit/axisctl/*.cpp)
  axisd_test(test_axisctl SOURCES ${sources} PRECOMPILED axisctl LINK axisctl_commands)

  # Debian's interpreter: python3-grpcio is a package of that one only.
  find_program(AXISD_PYTHON NAMES python3 PATHS /usr/bin NO_DEFAULT_PATH REQUIRED)
  add_test(NAME axisctl.against_fake_daemon
           COMMAND ${AXISD_PYTHON} -B ${CMAKE_SOURCE_DIR}/tests/axisctl/test_axisctl.py)
  add_test(NAME axisctl.budgets
           COMMAND ${AXISD_PYTHON} -B ${CMAKE_SOURCE_DIR}/tests/axisctl/test_axisctl_budget.py)
  add_test(NAME axisctl.drives_against_fake_daemon
           COMMAND ${AXISD_PYTHON} -B ${CMAKE_SOURCE_DIR}/tests/axisctl/test_axisctl_drives.py)
  add_test(NAME axisctl.simulated_drives
           COMMAND ${AXISD_PYTHON} -B ${CMAKE_SOURCE_DIR}/tests/axisctl/test_axisctl_sim.py)
  add_test(NAME axisctl.scripts_and_plots
           COMMAND ${AXISD_PYTHON} -B ${CMAKE_SOURCE_DIR}/tests/axisctl/test_axisctl_scripts.py)
  add_test(NAME python_client.against_fake_daemon
           COMMAND ${AXISD_PYTHON} -B ${CMAKE_SOURCE_DIR}/tests/axisctl/test_python_client.py)
  add_test(NAME leases.against_fake_daemon
           COMMAND ${AXISD_PYTHON} -B ${CMAKE_SOURCE_DIR}/tests/axisctl/test_leases.py)
  add_test(NAME explain.against_fake_daemon
           COMMAND ${AXISD_PYTHON} -B ${CMAKE_SOURCE_DIR}/tests/axisctl/test_explain.py)
  add_test(NAME stops.against_fake_daemon
           COMMAND ${AXISD_PYTHON} -B ${CMAKE_SOURCE_DIR}/tests/axisctl/test_stops.py)
  add_test(NAME state.against_fake_daemon
           COMMAND ${AXISD_PYTHON} -B ${CMAKE_SOURCE_DIR}/tests/axisctl/test_state.py)
  add_test(NAME tls.trouble_of_clients
           COMMAND ${AXISD_PYTHON} -B ${CMAKE_SOURCE_DIR}/tests/axisctl/test_tls_trouble.py)
  add_test(NAME axisctl.cell_of_fake_machines
           COMMAND ${AXISD_PYTHON} -B ${CMAKE_SOURCE_DIR}/tests/axisctl/test_axisctl_cell.py)
  add_test(NAME python_client.cell_of_fake_machines
           COMMAND ${AXISD_PYTHON} -B ${CMAKE_SOURCE_DIR}/tests/axisctl/test_python_cell.py)
  add_test(NAME python_client.package
           COMMAND ${AXISD_PYTHON} -B ${CMAKE_SOURCE_DIR}/tests/axisctl/test_python_package.py)
  set_tests_properties(axisctl.against_fake_daemon axisctl.budgets axisctl.cell_of_fake_machines axisctl.drives_against_fake_daemon
                       axisctl.scripts_and_plots axisctl.simulated_drives explain.against_fake_daemon leases.against_fake_daemon python_client.against_fake_daemon python_client.cell_of_fake_machines
                       python_client.package state.against_fake_daemon stops.against_fake_daemon tls.trouble_of_clients PROPERTIES
                       ENVIRONMENT "AXISCTL=$<TARGET_FILE:axisctl>" TIMEOUT 600)
endif()
