# A library of one folder: all its .cpp files, included as "folder/file.hpp". HOT: what tests run for minutes of CPU;
# AddressSanitizer makes it 5 to 10 times slower unless it is optimised a little, which doubles its time to compile.
# PRECOMPILED: headers for all of its files, by axisd_precompile.
function(axisd_library name)
  cmake_parse_arguments(ARG "HOT" "" "SOURCES;LINK;PRECOMPILED" ${ARGN})
  if(NOT ARG_SOURCES)
    file(GLOB ARG_SOURCES CONFIGURE_DEPENDS *.cpp)
  endif()
  add_library(${name} STATIC ${ARG_SOURCES})
  target_include_directories(${name} PUBLIC ${CMAKE_SOURCE_DIR})
  target_link_libraries(${name} PUBLIC ${ARG_LINK})
  if(ARG_PRECOMPILED)
    axisd_precompile(${name} ${ARG_PRECOMPILED})
  endif()
  if(ARG_HOT AND AXISD_SANITIZE MATCHES "address")
    target_compile_options(${name} PRIVATE -O1)
  endif()
endfunction()
