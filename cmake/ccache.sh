#!/bin/bash
# The compiler by ccache, so that clones at other places share its cache: no path of a command may begin where a clone
# lies. ccache makes them relative (CCACHE_BASEDIR), but for those behind -Xclang, of precompiled headers.
#   cmake/ccache.sh CCACHE SOURCE_DIR COMPILER [ARGUMENT ...]
# What a precompiled header defines is in its own hash (pch_defines), and no file prints when it was compiled
# (time_macros).
ccache=$1
export CCACHE_BASEDIR=$2 CCACHE_NOHASHDIR=1 CCACHE_SLOPPINESS=pch_defines,time_macros
shift 2
exec "$ccache" "${@/#"$PWD/"/}"
