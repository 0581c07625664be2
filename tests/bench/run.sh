#!/bin/bash
# Builds what the benchmarks need (preset release) and runs them; every figure stands beside a yardstick's, measured in
# the same run. See README.md.
#   tests/bench/run.sh [can|rtu|stop-all|index|rpc|cell|cell-load|cell-stop-all|machine|admission|siege|hang|page|store|all]      (default: all)
# Ends with 1 where a published bound of stops, StopAll or starts was exceeded, or one of those under siege, after a
# kill or after a hang, or a command failed on a full line or network, or an axis did not get its share of a line, or
# StopAll of a cell was late or named the wrong machines.
set -euo pipefail
cd "$(dirname "$(readlink -f "$0")")/../.."
part=${1:-all}
case "$part" in can | rtu | stop-all | index | rpc | cell | cell-load | cell-stop-all | machine | admission | siege | hang | page | store | all) ;; *)
  echo "usage: tests/bench/run.sh [can|rtu|stop-all|index|rpc|cell|cell-load|cell-stop-all|machine|admission|siege|hang|page|store|all]" >&2
  exit 2
  ;;
esac
wants() { [ "$part" = "$1" ] || [ "$part" = all ]; }

deploy/install-packages.sh test
cmake --preset release >/dev/null
ninja -C build/release --quiet bench_programs
status=0
if wants can; then
  build/release/tests/bench_can bring-up 32
  build/release/tests/bench_can core 16
  build/release/tests/bench_can index 32 || status=$?
  build/release/tests/bench_can groups 16 || status=$?
  tests/guest/run.sh -t 400 /usr/bin/python3 -B tests/bench/can_bench.py build/release
fi
if wants rtu; then build/release/tests/bench_queue; fi
if wants index; then
  for each in rates stops "done" groups; do build/release/tests/bench_index "$each" || status=$?; done
fi
for each in rtu stop-all index rpc cell cell-load cell-stop-all machine admission siege hang store; do
  if wants "$each"; then /usr/bin/python3 -B "tests/bench/${each//-/_}_bench.py" build/release || status=$?; fi
done
if wants siege; then /usr/bin/python3 -B tests/bench/siege_bench.py build/release --kill 5 || status=$?; fi
if wants page; then
  (cd api/web && npm ci --ignore-scripts --no-audit --no-fund --loglevel=error)
  node tests/bench/page_bench.mjs build/release
fi
exit "$status"
