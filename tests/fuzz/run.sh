#!/bin/bash
# Looks for inputs that break what takes bytes from outside: libFuzzer under AddressSanitizer and UBSan, each target
# for so long or so often. What breaks one is left in build/fuzz/found/. As many targets at a time as there are processors.
#   tests/fuzz/run.sh SECONDS [TARGET ...]              (default: all targets)
#   tests/fuzz/run.sh executions N [TARGET ...]         N executions of each at least
#   tests/fuzz/run.sh merge [TARGET ...]                adds what was found to be new to the corpora in the tree
set -euo pipefail
cd "$(dirname "$(readlink -f "$0")")/../.."
usage() {
  echo "usage: tests/fuzz/run.sh SECONDS|executions N|merge [TARGET ...]" >&2
  exit 2
}
what=${1-}
shift || usage
limit=-max_total_time=$what
executions=0
case "$what" in
  merge) ;;
  executions)
    executions=${1-}
    shift || usage
    [[ $executions =~ ^[1-9][0-9]*$ ]] || usage
    limit=-runs=$executions
    ;;
  *) [[ $what =~ ^[1-9][0-9]*$ ]] || usage ;;
esac
targets=("$@")
[ "${#targets[@]}" -gt 0 ] || mapfile -t targets < <(ls tests/fuzz/corpus)

deploy/install-packages.sh test
cmake --preset fuzz >/dev/null
ninja -C build/fuzz --quiet "${targets[@]/#/fuzz_}"
symbolizer=$(command -v llvm-symbolizer-19)
export ASAN_OPTIONS="external_symbolizer_path=$symbolizer"
export UBSAN_OPTIONS="print_stacktrace=1:halt_on_error=1:$ASAN_OPTIONS"
# By the clock on the wall: on a computer that is busy with other things, too, an input may take seconds.
patience=60
found=build/fuzz/found
mkdir -p "$found"
fuzz_one() {
  local target=$1 grown="build/fuzz/grown/$1" seeds="tests/fuzz/corpus/$1" count
  mkdir -p "$grown"
  if [ "$what" = merge ]; then
    "build/fuzz/tests/fuzz_$target" -merge=1 -max_len=1024 "$seeds" "$grown" 2>"$found/$target.log"
    return
  fi
  if ! "build/fuzz/tests/fuzz_$target" "$limit" -max_len=4096 -timeout="$patience" -rss_limit_mb=2048 \
    -print_final_stats=1 -artifact_prefix="$found/$target-" "$grown" "$seeds" 2>"$found/$target.log"; then
    echo "$target: FAILED: $found/$target.log"
    return 1
  fi
  count=$(awk '/stat::number_of_executed_units/ { print $2 }' "$found/$target.log")
  echo "$target: ${count:-0} executions"
  if [ "${count:-0}" -lt "$executions" ]; then
    echo "$target: FAILED: fewer than $executions: $found/$target.log"
    return 1
  fi
}
export -f fuzz_one
export what limit executions found patience
printf '%s\n' "${targets[@]}" | xargs -P "$(nproc)" -I{} bash -euc 'fuzz_one {}'
