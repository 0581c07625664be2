file(GLOB sources CONFIGURE_DEPENDS unit/daemon/store/*.cpp)
axisd_test(test_store SOURCES ${sources} LINK axisd_core)
