# Compiler settings for every target.
find_program(AXISD_CCACHE ccache)
if(AXISD_CCACHE)
  set(CMAKE_CXX_COMPILER_LAUNCHER ${CMAKE_SOURCE_DIR}/cmake/ccache.sh ${AXISD_CCACHE} ${CMAKE_SOURCE_DIR})
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
