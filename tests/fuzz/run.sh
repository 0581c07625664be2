#!/bin/bash
# Looks for inputs that break what takes bytes from outside: libFuzzer under AddressSanitizer and UBSan, each target
# for so long. What breaks one is left in build/fuzz/found/.
#   tests/fuzz/run.sh SECONDS [TARGET ...]      (default: all targets)
#   tests/fuzz/run.sh merge [TARGET ...]        adds what was found to be new to the corpora in the tree
set -euo pipefail
cd "$(dirname "$(readlink -f "$0")")/../.."
what=${1:?usage: tests/fuzz/run.sh SECONDS|merge [TARGET ...]}
shift
case "$what" in merge | [1-9]*) ;; *)
  echo "usage: tests/fuzz/run.sh SECONDS|merge [TARGET ...]" >&2
  exit 2
  ;;
esac
targets=("$@")
[ "${#targets[@]}" -gt 0 ] || mapfile -t targets < <(ls tests/fuzz/corpus)

deploy/install-packages.sh test
cmake --preset fuzz >/dev/null
ninja -C build/fuzz --quiet "${targets[@]/#/fuzz_}"
symbolizer=$(command -v llvm-symbolizer-19)
export ASAN_OPTIONS="external_symbolizer_path=$symbolizer"
export UBSAN_OPTIONS="print_stacktrace=1:halt_on_error=1:$ASAN_OPTIONS"
found=build/fuzz/found
mkdir -p "$found"
fuzz_one() {
  local target=$1 grown="build/fuzz/grown/$1" seeds="tests/fuzz/corpus/$1"
  mkdir -p "$grown"
  if [ "$what" = merge ]; then
    "build/fuzz/tests/fuzz_$target" -merge=1 -max_len=1024 "$seeds" "$grown" 2>"$found/$target.log"
  elif ! "build/fuzz/tests/fuzz_$target" -max_total_time="$what" -max_len=4096 -timeout=10 -rss_limit_mb=2048 \
    -print_final_stats=1 -artifact_prefix="$found/$target-" "$grown" "$seeds" 2>"$found/$target.log"; then
    echo "$target: FAILED: $found/$target.log"
    return 1
  fi
  awk -v target="$target" '/stat::number_of_executed_units/ { print target ": " $2 " executions" }' "$found/$target.log"
}
export -f fuzz_one
export what found
printf '%s\n' "${targets[@]}" | xargs -P "$(nproc)" -I{} bash -euc 'fuzz_one {}'
