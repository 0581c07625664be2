file(GLOB sources CONFIGURE_DEPENDS unit/daemon/link/*.cpp)
axisd_test(test_link SOURCES ${sources} ${CMAKE_SOURCE_DIR}/daemon/link/request.cpp LINK axisd_buses)
