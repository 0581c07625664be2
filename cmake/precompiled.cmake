# Headers that each target parses once instead of in every file: what costs most of the time to compile. Every file still
# includes what it uses; ThreadSanitizer's preset builds without (CMAKE_DISABLE_PRECOMPILE_HEADERS) and finds what is
# missing below the API. Without its timestamp a precompiled header is the same each time, so that ccache knows what used
# it: in clones at the same place only, as it names the headers that it was made of.
# Arguments behind the target: files of cmake/precompiled.
function(axisd_precompile target)
  list(TRANSFORM ARGN PREPEND "<cmake/precompiled/")
  list(TRANSFORM ARGN APPEND ".hpp>")
  target_include_directories(${target} PRIVATE ${CMAKE_SOURCE_DIR})
  target_compile_options(${target} PRIVATE "SHELL:-Xclang -fno-pch-timestamp")
  target_precompile_headers(${target} PRIVATE ${ARGN})
endfunction()
