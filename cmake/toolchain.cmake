# Compiler settings for every target.
find_program(AXISD_CCACHE ccache)
if(AXISD_CCACHE)
  # A base directory and no hashed working directory: clones at other places share one cache. What a precompiled header
  # defines is in its own hash (pch_defines), and no file prints when it was compiled (time_macros).
  set(CMAKE_CXX_COMPILER_LAUNCHER ${CMAKE_COMMAND} -E env CCACHE_BASEDIR=${CMAKE_SOURCE_DIR} CCACHE_NOHASHDIR=1
                                  CCACHE_SLOPPINESS=pch_defines,time_macros ${AXISD_CCACHE})
  set(CMAKE_C_COMPILER_LAUNCHER ${CMAKE_CXX_COMPILER_LAUNCHER})
endif()

add_compile_options(-Wall -Wextra -Wpedantic -Wshadow -Wnon-virtual-dtor -Woverloaded-virtual -Wno-missing-designated-field-initializers
                    -ffile-prefix-map=${CMAKE_SOURCE_DIR}/= -fdebug-compilation-dir=.)
if(CMAKE_BUILD_TYPE STREQUAL "Debug")
  # Unoptimised: coroutines and gRPC compile 2.5 times as fast. What is slow all the same is HOT (axisd.cmake).
  add_compile_options(-O0 -g1)
  add_compile_definitions(_GLIBCXX_ASSERTIONS)
endif()
add_compile_definitions(AXISD_VERSION="${PROJECT_VERSION}" SPDLOG_FMT_EXTERNAL BOOST_ASIO_NO_DEPRECATED)
add_link_options(-fuse-ld=lld-19)

option(AXISD_FUZZ "Link the fuzz targets with libFuzzer, and instrument everything for it" OFF)
if(AXISD_FUZZ)
  add_compile_options(-fsanitize=fuzzer-no-link)
endif()
if(AXISD_SANITIZE)
  add_compile_options(-fsanitize=${AXISD_SANITIZE} -fno-omit-frame-pointer -fno-sanitize-recover=all)
  add_link_options(-fsanitize=${AXISD_SANITIZE})
endif()
