#!/bin/bash
# From a fresh clone to moving axes: installs what is missing, builds, starts axisd with simulated drives on RS-485 and CAN
# (config/examples/demo.yaml) and moves four of them with axisctl. No hardware, nothing outside build/ and a temporary
# directory is written (packages apart).
#   deploy/quickstart.sh          keeps the axes moving and shows them until Ctrl-C
#   deploy/quickstart.sh --once   shows each thing once and ends: status 0, no process left
set -euo pipefail
cd "$(dirname "$(readlink -f "$0")")/.."

case "${1:-}" in
  '' | --once) once=${1:-} ;;
  *) echo "usage: deploy/quickstart.sh [--once]" >&2; exit 2 ;;
esac

scratch=$(mktemp -d "${TMPDIR:-/tmp}/axisd-quickstart.XXXXXX")
daemon='' mover='' web=''

say() { printf '\n== %s\n' "$*"; }
die() { echo "quickstart.sh: $*" >&2; exit 1; }

end_group() {  # a background job with everything that it started
  [ -n "$1" ] || return 0
  kill -TERM -- "-$1" 2>/dev/null || true
  for _ in $(seq 50); do kill -0 -- "-$1" 2>/dev/null || break; sleep 0.1; done
  kill -KILL -- "-$1" 2>/dev/null || true
  wait "$1" 2>/dev/null || true
}
clean_up() {
  local status=$?
  trap '' INT TERM
  end_group "$mover"
  end_group "$web"
  end_group "$daemon"
  if [ "$status" -ne 0 ] && [ -s "$scratch/axisd.log" ]; then
    echo "-- the last lines of axisd's log:" >&2
    tail -n 30 "$scratch/axisd.log" >&2
  fi
  rm -rf "$scratch"
  exit "$status"
}
trap clean_up EXIT
trap 'exit 130' INT
trap 'exit 143' TERM

# Ninja's "[12/345] ..." as one line that counts; off a terminal a line for each tenth.
show_build() {
  local line percent tenth=-1
  while IFS= read -r line; do
    [[ $line =~ ^\[([0-9]+)/([0-9]+)\] ]] || continue
    percent=$((100 * BASH_REMATCH[1] / BASH_REMATCH[2]))
    if [ -t 1 ]; then
      printf '\r   %3d %%  %s of %s ' "$percent" "${BASH_REMATCH[1]}" "${BASH_REMATCH[2]}"
    elif [ $((percent / 10)) -ne "$tenth" ]; then
      tenth=$((percent / 10))
      echo "   $percent %"
    fi
  done
  if [ -t 1 ]; then echo; fi
}

say "Packages and build (some minutes the first time)"
deploy/install-packages.sh build
deploy/install-packages.sh run
if ! { cmake --preset release && cmake --build --preset release --target axisd axisctl axisd-sim axisd-web; } 2>&1 |
    tee "$scratch/build.log" | show_build; then
  tail -n 60 "$scratch/build.log" >&2
  die "the build failed"
fi
deploy/page.sh build/web || die "the page of axisd-web was not built"
bin=$PWD/build/release
axisd=$bin/daemon/axisd axisctl=$bin/api/axisctl/axisctl
printf -v folders '%q:%q' "$bin/daemon" "$bin/api/axisctl"
path="export PATH=$folders:\"\$PATH\""
"$axisctl" check config/examples/demo.yaml >/dev/null || die "config/examples/demo.yaml does not pass axisctl check"

taken() { (exec 3<>"/dev/tcp/127.0.0.1/$1") 2>/dev/null || (exec 3<>"/dev/tcp/::1/$1") 2>/dev/null; }
port=7443
while taken "$port" || taken $((port + 1)); do port=$((20000 + RANDOM % 10000)); done
export AXISD_SERVER=localhost:$port

say "axisd with simulated drives on RS-485 and CAN, on $AXISD_SERVER"
if [ -z "$once" ]; then
  echo "To command them from another terminal while this one runs, type there:"
  echo "  $path AXISD_SERVER=$AXISD_SERVER"
fi
# Background jobs get process groups of their own (set -m): Ctrl-C ends the demonstration in order, and end_group
# leaves nothing behind.
set -m
"$axisd" --config config/examples/demo.yaml --state-directory "$scratch/state" --listen "$AXISD_SERVER" \
  >"$scratch/axisd.log" 2>&1 &
daemon=$!
page=7480
while taken "$page"; do page=$((30000 + RANDOM % 10000)); done
install -m 600 /dev/null "$scratch/users" # nobody: whoever is at this computer is let in
cat >"$scratch/web.yaml" <<END
listen: localhost:$page
axisd: { server: $AXISD_SERVER }
files: $PWD/build/web
users: $scratch/users
END
"$bin/api/web/gateway/axisd-web" --config "$scratch/web.yaml" >"$scratch/web.log" 2>&1 &
web=$!
set +m

# Repeats a command until it succeeds, while axisd lives; its own complaint is shown when it never does.
eventually() {
  for _ in $(seq 100); do
    "$@" >"$scratch/last" 2>&1 && return 0
    kill -0 "$daemon" 2>/dev/null || die "axisd ended by itself"
    sleep 0.1
  done
  cat "$scratch/last" >&2
  die "did not succeed within its time: $*"
}
step() {  # shows a command as it would be typed, and runs it
  echo "\$ $*"
  "$axisctl" "${@:2}" || die "failed: $*"
}
eventually "$axisctl" list
kill -0 "$web" 2>/dev/null || { cat "$scratch/web.log" >&2; die "axisd-web ended by itself"; }
[ -n "$once" ] || echo "The machine in a browser of this computer: http://localhost:$page"
for axis in feeder lifter turntable carousel; do
  eventually "$axisctl" enable "$axis" --wait  # refused until the drive's identity and configuration are verified
done
step axisctl list

say "Homing and moving"
step axisctl home feeder --wait
step axisctl home lifter --wait
step axisctl home turntable --wait
step axisctl home carousel --wait
step axisctl move lifter 100mm --velocity 100mm/s --wait
step axisctl move turntable 90deg --relative --velocity 90deg/s --wait
step axisctl move carousel 90deg --relative --velocity 90deg/s --wait
step axisctl move feeder 120mm --velocity 50mm/s  # goes on while it is watched
step axisctl watch --period 500ms --count 8

if [ -z "$once" ]; then
  say "To and fro until Ctrl-C"
  set -m
  {
    while "$axisctl" move feeder 20mm --velocity 80mm/s --wait && "$axisctl" move lifter 200mm --wait &&
        "$axisctl" move feeder 300mm --velocity 80mm/s --wait && "$axisctl" move lifter 20mm --wait; do
      "$axisctl" move turntable 30deg --relative --wait || break
    done
  } >"$scratch/mover.log" 2>&1 &
  mover=$!
  set +m
  interrupted=''
  trap 'interrupted=1' INT
  "$axisctl" watch || true
  trap 'exit 130' INT
  [ -n "$interrupted" ] || { cat "$scratch/mover.log" >&2; die "axisctl watch ended by itself"; }
  kill -0 "$mover" 2>/dev/null || { cat "$scratch/mover.log" >&2; die "the axes stopped moving to and fro"; }
  end_group "$mover"
  mover=''
fi

say "Stopping and switching off"
step axisctl stop --all
step axisctl release-stop --all
for axis in feeder lifter turntable carousel; do step axisctl disable "$axis" --wait; done
end_group "$web"
web=''
kill -TERM "$daemon"
wait "$daemon" || die "axisd ended with status $?"
daemon=''
say "Done"
cat <<END
To go on in this shell as README.md does, type:
  $path
  axisd --config config/examples/demo.yaml >/tmp/axisd-demo.log 2>&1 & sleep 2
  axisctl list
END
