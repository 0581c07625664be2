# A registry of its own takes the place of the product's: there the fifth model stands beside the others.
get_property(models GLOBAL PROPERTY AXISD_DRIVE_MODELS)
axisd_registries(${CMAKE_CURRENT_BINARY_DIR}/foreign_modbus ${models} acme_s1)
file(GLOB sources CONFIGURE_DEPENDS foreign_modbus/*.cpp)
axisd_test(test_foreign_modbus
           SOURCES ${sources} ${CMAKE_CURRENT_BINARY_DIR}/foreign_modbus/registry.cpp
                   ${CMAKE_CURRENT_BINARY_DIR}/foreign_modbus/simulators.cpp
           PRECOMPILED devices LINK axisd_core)
