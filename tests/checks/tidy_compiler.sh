#!/bin/bash
# clang-tidy with the face of a compiler, for ccache: a file that was found clean, and all it includes, is remembered as
# if it had been compiled. Findings are the compiler's errors, and those are never remembered. For tests/checks/tidy.py,
# which says by AXISD_TIDY_OPTIONS with what clang-tidy is called.
set -euo pipefail
flags=() output='' source=''
while [ $# -gt 0 ]; do
  case "$1" in
    -E) exec clang++-19 -C "${flags[@]}" "$@" ;;  # ccache asks for it. Comments count: NOLINT, and lines of a function.
    -o) output=$2; shift ;;
    -c) ;;
    *.cpp | *.cc) source=$1 ;;
    *) flags+=("$1") ;;
  esac
  shift
done
[ -n "$output" ] && [ -n "$source" ] || { echo "tidy_compiler.sh: no compilation" >&2; exit 2; }
read -ra options <<<"${AXISD_TIDY_OPTIONS:-}"
if ! said=$(clang-tidy-19 --quiet "${options[@]}" "$source" -- "${flags[@]}" 2>&1); then
  echo "$said" >&2
  exit 1
fi
echo clean >"$output"
