#!/bin/bash
# Installs what is missing, builds, and runs the tests; the last lines are ctest's summary of all of them.
#   tests/run.sh quick    preset dev
#   tests/run.sh all      the same tests under AddressSanitizer + UBSan (preset asan), those without gRPC, whose library
#                         is not instrumented, under ThreadSanitizer (preset tsan), and clang-tidy on changed files.
#                         Default. Not the preset dev as well: it differs from asan in the sanitizers only.
set -euo pipefail
cd "$(dirname "$(readlink -f "$0")")/.."

case "${1:-all}" in
  quick) presets=(dev) selection=(--label-exclude slow) ;;
  all) presets=(asan tsan) selection=() ;;
  *) echo "usage: tests/run.sh [quick|all]" >&2; exit 2 ;;
esac
jobs=$(nproc)

deploy/install-packages.sh test
if ! compgen -G 'node_modules/@bufbuild/buf-linux-*/bin/buf' >/dev/null; then
  npm ci --ignore-scripts --no-audit --no-fund --loglevel=error
fi

symbolizer=$(command -v llvm-symbolizer-19)
export ASAN_OPTIONS="detect_stack_use_after_return=1:external_symbolizer_path=$symbolizer"
export UBSAN_OPTIONS="print_stacktrace=1:halt_on_error=1:external_symbolizer_path=$symbolizer"
export TSAN_OPTIONS="halt_on_error=1:second_deadlock_stack=1:external_symbolizer_path=$symbolizer"

failed=()
for preset in "${presets[@]}"; do
  mkdir -p "build/$preset"
  echo "== build $preset"
  begun=$SECONDS
  if ! cmake --preset "$preset" >"build/$preset/configure.log" 2>&1; then
    cat "build/$preset/configure.log"
    failed+=("$preset (configure)")
  elif ! ninja -C "build/$preset" -j "$jobs" --quiet; then
    failed+=("$preset (build)")
  fi
  echo "== $preset: $((SECONDS - begun)) s"
done

# One run over all presets: one pool of jobs, one summary. What could not be built fails in it, too.
mkdir -p build/all
for preset in "${presets[@]}"; do printf 'subdirs("%s")\n' "$PWD/build/$preset"; done >build/all/CTestTestfile.cmake
[ "${#failed[@]}" -eq 0 ] || printf 'run.sh: FAILED: %s\n' "${failed[@]}"
status=0
ctest --test-dir build/all -j "$jobs" --output-on-failure --no-tests=error "${selection[@]}" || status=$?
[ "${#failed[@]}" -eq 0 ] || exit 1
exit "$status"
