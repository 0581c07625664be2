# deploy/pki.sh, as openssl judges what it makes. packages.sh is run by hand: it needs root, and some minutes.
if(AXISD_SANITIZE MATCHES "thread")
  return()
endif()
add_test(NAME ${AXISD_TEST_PREFIX}deploy.pki COMMAND ${CMAKE_SOURCE_DIR}/tests/deploy/pki.sh)
set_tests_properties(${AXISD_TEST_PREFIX}deploy.pki PROPERTIES TIMEOUT 120 LABELS checks)
