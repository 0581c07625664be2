#!/bin/bash
# Builds what the benchmarks need (preset release) and runs them; every figure stands beside a yardstick's, measured in
# the same run. See README.md.
#   tests/bench/run.sh can
set -euo pipefail
cd "$(dirname "$(readlink -f "$0")")/../.."
[ "${1:-}" = can ] || { echo "usage: tests/bench/run.sh can" >&2; exit 2; }

deploy/install-packages.sh test
cmake --preset release >/dev/null
ninja -C build/release --quiet axisd axisd-sim axisctl bench_can bench_bare_loop
build/release/tests/bench_can bring-up 32
build/release/tests/bench_can core 16
tests/guest/run.sh -t 400 /usr/bin/python3 -B tests/bench/can_bench.py build/release
