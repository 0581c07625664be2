# The page of axisd-web: its parts, itself in Chromium before a gateway that is made up, and with the real one. As the checks:
# in the presets dev and asan, one of which is in every run.
if(AXISD_SANITIZE MATCHES "thread")
  return()
endif()
find_program(AXISD_NODE NAMES node nodejs REQUIRED)
set(web ${CMAKE_SOURCE_DIR}/api/web)
set(page_tests ${CMAKE_CURRENT_LIST_DIR})
add_test(NAME web_page.stubs COMMAND ${AXISD_NODE} ${web}/tools/stubs.mjs)
add_test(NAME web_page.types COMMAND ${AXISD_NODE} ${web}/node_modules/typescript/bin/tsc --noEmit -p ${web}/tsconfig.json)
add_test(NAME web_page.types_of_tests
         COMMAND ${AXISD_NODE} ${web}/node_modules/typescript/bin/tsc --noEmit -p ${page_tests}/tsconfig.json)
add_test(NAME web_page.unit COMMAND ${AXISD_NODE} ${web}/tools/test.mjs WORKING_DIRECTORY ${web})
add_test(NAME web_page.browser COMMAND ${AXISD_NODE} ${page_tests}/run.mjs ${CMAKE_BINARY_DIR}/web_page page cell load)
# For people: build/*/web_page_pictures/pictures.
add_test(NAME web_page.pictures COMMAND ${AXISD_NODE} ${page_tests}/run.mjs ${CMAKE_BINARY_DIR}/web_page_pictures pictures)
set(names types types_of_tests unit browser pictures)
if(TARGET axisd-web)
  foreach(name IN ITEMS real explain hidden windows scope)
    add_test(NAME web_page.${name} COMMAND ${AXISD_NODE} ${page_tests}/real.mjs ${CMAKE_BINARY_DIR}/web_page_${name} ${name})
    set_tests_properties(web_page.${name} PROPERTIES ENVIRONMENT
      "AXISD=$<TARGET_FILE:axisd>;AXISD_WEB=$<TARGET_FILE:axisd-web>;AXISCTL=$<TARGET_FILE:axisctl>;AXISD_SANITIZE=${AXISD_SANITIZE}")
    list(APPEND names ${name})
  endforeach()
endif()
list(TRANSFORM names PREPEND web_page.)
set_tests_properties(web_page.stubs PROPERTIES FIXTURES_SETUP web_page_stubs TIMEOUT 60)
set_tests_properties(${names} PROPERTIES FIXTURES_REQUIRED web_page_stubs TIMEOUT 600 LABELS web)
# They hold buttons and measure how soon an axis rests.
set(browsers ${names})
list(FILTER browsers INCLUDE REGEX "browser|real|explain|hidden|windows|scope")
set_tests_properties(${browsers} PROPERTIES RUN_SERIAL ON)
set_tests_properties(web_page.pictures PROPERTIES LABELS "web;slow")
