# One thread in virtual time: nothing for ThreadSanitizer to see.
if(NOT AXISD_SANITIZE MATCHES "thread")
  file(GLOB sources CONFIGURE_DEPENDS chaos/*.cpp)
  axisd_test(test_chaos SOURCES ${sources} PRECOMPILED devices LINK axisd_core PARTS 4)
endif()
