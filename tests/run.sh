#!/bin/bash
# Installs what is missing, builds, and runs the tests; the last lines are ctest's summary of all of them.
#   tests/run.sh quick    preset dev
#   tests/run.sh all      the same tests under AddressSanitizer + UBSan (preset asan), those without gRPC, whose library
#                         is not instrumented, under ThreadSanitizer (preset tsan), clang-tidy on changed files, and
#                         in preset release, as it is fast, all rules, the whole conformance suite and
#                         100,000 faulted transactions (asan runs a sample of each), the scenarios on SocketCAN, whose
#                         guests are too small for AddressSanitizer, and that the benchmarks run.
#                         Default.
set -euo pipefail
cd "$(dirname "$(readlink -f "$0")")/.."

case "${1:-all}" in
  quick) presets=(dev) whole=() selection=(--label-exclude slow) ;;
  all)
    presets=(asan tsan) whole=(test_rules test_conformance test_chaos can_scenarios bench_programs) selection=()
    ;;
  *) echo "usage: tests/run.sh [quick|all]" >&2; exit 2 ;;
esac
jobs=$(nproc)

deploy/install-packages.sh test
node_packages() { (cd "$1" && npm ci --ignore-scripts --no-audit --no-fund --loglevel=error); }
compgen -G 'node_modules/@bufbuild/buf-linux-*/bin/buf' >/dev/null || node_packages .
[ -d api/examples/node/node_modules/@grpc/grpc-js ] || node_packages api/examples/node
[ -d tests/foreign/node_modules/canopen ] || node_packages tests/foreign
[ -d api/web/node_modules/esbuild ] || node_packages api/web

symbolizer=$(command -v llvm-symbolizer-19)
export ASAN_OPTIONS="detect_stack_use_after_return=1:external_symbolizer_path=$symbolizer"
export UBSAN_OPTIONS="print_stacktrace=1:halt_on_error=1:external_symbolizer_path=$symbolizer"
export TSAN_OPTIONS="halt_on_error=1:second_deadlock_stack=1:external_symbolizer_path=$symbolizer"

failed=()
build() {  # PRESET [TARGET ...]
  local preset=$1 begun=$SECONDS
  shift
  mkdir -p "build/$preset"
  echo "== build $preset $*"
  if ! cmake --preset "$preset" >"build/$preset/configure.log" 2>&1; then
    cat "build/$preset/configure.log"
    failed+=("$preset (configure)")
  elif ! ninja -C "build/$preset" -j "$jobs" --quiet "$@"; then
    failed+=("$preset (build)")
  fi
  echo "== $preset: $((SECONDS - begun)) s"
}
for preset in "${presets[@]}"; do build "$preset"; done
[ "${#whole[@]}" -eq 0 ] || build release "${whole[@]}"

# One run over all presets: one pool of jobs, one summary. What could not be built fails in it, too. One job more than
# there are processors: many tests wait most of their time.
mkdir -p build/all
{
  for preset in "${presets[@]}"; do printf 'subdirs("%s")\n' "$PWD/build/$preset"; done
  for target in "${whole[@]}"; do printf 'include("%s")\n' "$PWD/build/release/tests/$target"*_include.cmake; done
} >build/all/CTestTestfile.cmake
[ "${#failed[@]}" -eq 0 ] || printf 'run.sh: FAILED: %s\n' "${failed[@]}"
status=0
ctest --test-dir build/all -j "$((jobs + 1))" --output-on-failure --no-tests=error "${selection[@]}" || status=$?
[ "${#failed[@]}" -eq 0 ] || exit 1
exit "$status"
