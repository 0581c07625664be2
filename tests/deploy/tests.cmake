# deploy/pki.sh, as openssl judges what it makes, and deploy/install.sh. packages.sh and units.sh are run by hand: they need
# root, and some minutes.
if(AXISD_SANITIZE MATCHES "thread")
  return()
endif()
add_test(NAME ${AXISD_TEST_PREFIX}deploy.pki COMMAND ${CMAKE_SOURCE_DIR}/tests/deploy/pki.sh)
set_tests_properties(${AXISD_TEST_PREFIX}deploy.pki PROPERTIES TIMEOUT 120 LABELS checks)
if(AXISD_GRPC)
  add_test(NAME ${AXISD_TEST_PREFIX}deploy.install COMMAND ${CMAKE_SOURCE_DIR}/tests/deploy/install.sh ${CMAKE_BINARY_DIR})
  # Each installation writes the build's install_manifest.txt.
  set_tests_properties(${AXISD_TEST_PREFIX}deploy.install PROPERTIES TIMEOUT 300 LABELS checks RESOURCE_LOCK install_manifest)
endif()
