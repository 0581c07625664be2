# axisctl and the Python client need gRPC on both sides.
if(AXISD_GRPC)
  file(GLOB sources CONFIGURE_DEPENDS unit/axisctl/*.cpp)
  axisd_test(test_axisctl SOURCES ${sources} PRECOMPILED axisctl LINK axisctl_commands)

  # Debian's interpreter: python3-grpcio is a package of that one only.
  find_program(AXISD_PYTHON NAMES python3 PATHS /usr/bin NO_DEFAULT_PATH REQUIRED)
  add_test(NAME axisctl.commands
           COMMAND ${AXISD_PYTHON} -B ${CMAKE_SOURCE_DIR}/tests/axisctl/test_axisctl.py)
  add_test(NAME axisctl.budgets
           COMMAND ${AXISD_PYTHON} -B ${CMAKE_SOURCE_DIR}/tests/axisctl/test_axisctl_budget.py)
  add_test(NAME axisctl.drives
           COMMAND ${AXISD_PYTHON} -B ${CMAKE_SOURCE_DIR}/tests/axisctl/test_axisctl_drives.py)
  add_test(NAME axisctl.simulated_drives
           COMMAND ${AXISD_PYTHON} -B ${CMAKE_SOURCE_DIR}/tests/axisctl/test_axisctl_sim.py)
  add_test(NAME axisctl.scripts_and_plots
           COMMAND ${AXISD_PYTHON} -B ${CMAKE_SOURCE_DIR}/tests/axisctl/test_axisctl_scripts.py)
  add_test(NAME python_client.commands
           COMMAND ${AXISD_PYTHON} -B ${CMAKE_SOURCE_DIR}/tests/axisctl/test_python_client.py)
  add_test(NAME clients.leases
           COMMAND ${AXISD_PYTHON} -B ${CMAKE_SOURCE_DIR}/tests/axisctl/test_leases.py)
  add_test(NAME clients.explain
           COMMAND ${AXISD_PYTHON} -B ${CMAKE_SOURCE_DIR}/tests/axisctl/test_explain.py)
  add_test(NAME clients.stops
           COMMAND ${AXISD_PYTHON} -B ${CMAKE_SOURCE_DIR}/tests/axisctl/test_stops.py)
  add_test(NAME clients.state
           COMMAND ${AXISD_PYTHON} -B ${CMAKE_SOURCE_DIR}/tests/axisctl/test_state.py)
  add_test(NAME clients.tls_trouble
           COMMAND ${AXISD_PYTHON} -B ${CMAKE_SOURCE_DIR}/tests/axisctl/test_tls_trouble.py)
  add_test(NAME axisctl.fake_cell
           COMMAND ${AXISD_PYTHON} -B ${CMAKE_SOURCE_DIR}/tests/axisctl/test_axisctl_cell.py)
  add_test(NAME python_client.fake_cell
           COMMAND ${AXISD_PYTHON} -B ${CMAKE_SOURCE_DIR}/tests/axisctl/test_python_cell.py)
  add_test(NAME python_client.package
           COMMAND ${AXISD_PYTHON} -B ${CMAKE_SOURCE_DIR}/tests/axisctl/test_python_package.py)
  # They run against axisd with simulated drives.
  set_tests_properties(axisctl.budgets axisctl.fake_cell axisctl.commands axisctl.drives axisctl.scripts_and_plots
                       axisctl.simulated_drives clients.explain clients.leases clients.state clients.stops clients.tls_trouble
                       python_client.fake_cell python_client.commands python_client.package PROPERTIES
                       ENVIRONMENT "AXISCTL=$<TARGET_FILE:axisctl>;AXISD=$<TARGET_FILE:axisd>;AXISD_SIM=$<TARGET_FILE:axisd-sim>" TIMEOUT 600)
endif()
