#!/bin/bash
# Runs a command as root in a User Mode Linux guest: a Linux kernel that is an ordinary process, with this machine's
# file system and SocketCAN, which the kernel of this machine need not have. vcan0 and vcan1 are up there.
#   tests/guest/run.sh [-v] [-t SECONDS] [-m MEMORY] COMMAND [ARGUMENT...]
# Prints what the command prints (standard output and error in one). Exits with its status; 124: it ran past the limit
# (default 60 s); 125: the guest failed, and its console is printed. UML_DEBUG=1 prints the console in any case.
# -v: virtual time: while everything in the guest waits, none passes outside (idle.c); the limit is outside's. Programs
# are in time there whatever else this machine does; real time is for measurements.
# Needs the packages of deploy/install-packages.sh test. AddressSanitizer and ThreadSanitizer programs do not start in
# it: there is too little address space. It has one CPU and HZ=100: test behaviour there, not microseconds.
set -uo pipefail
here=$(dirname "$(readlink -f "$0")")

die() { echo "run.sh: $*" >&2; exit 125; }

limit=60 memory=512M virtual=
while getopts t:m:v option; do
  case $option in
    v) virtual=1 ;;
    t) limit=$OPTARG ;;
    m) memory=$OPTARG ;;
    *) die "usage: run.sh [-v] [-t SECONDS] [-m MEMORY] COMMAND [ARGUMENT...]" ;;
  esac
done
shift $((OPTIND - 1))
[ $# -gt 0 ] || die "no command given"
command -v linux.uml >/dev/null || die "there is no linux.uml: install user-mode-linux (deploy/install-packages.sh test)"

job=$(mktemp -d /tmp/axisd-guest.XXXXXX) || die "cannot create a directory in /tmp"
trap 'rm -rf "$job"' EXIT
trap 'exit 125' INT TERM
{ export -p; printf 'cd %q && exec' "$PWD"; printf ' %q' "$@"; echo; } >"$job/command"
preloaded=("$here/xstate.c")
[ -z "$virtual" ] || preloaded+=("$here/idle.c")
clang-19 -O2 -shared -fPIC -o "$job/preload.so" "${preloaded[@]}" || die "cannot compile ${preloaded[*]}"

# All of the guest on one CPU: system calls take a sixth of the time that they take across two. Guests side by side take
# one each, as long as there are enough: a lock for each, held until this script ends.
mapfile -t cpus < <(taskset -cp $$ | sed 's/.*: //' | tr , '\n' | while IFS=- read -r a b; do seq "$a" "${b:-$a}"; done)
cpu=
for candidate in "${cpus[@]}"; do
  { exec {lock}>"/tmp/axisd-guest-cpu-$candidate.lock"; } 2>/dev/null || continue
  if flock -n "$lock"; then
    cpu=$candidate
    break
  fi
  exec {lock}>&-
done
cpu=${cpu:-${cpus[RANDOM % ${#cpus[@]}]}}

# /dev/shm: the guest's memory is a file there, which must not be on a disk. HOME: the guest writes its sockets to it.
# With a time of its own, a guest cannot know when it ran too long.
guest_limit=$limit
[ -z "$virtual" ] || guest_limit=0
HOME=$job TMPDIR=/dev/shm timeout -k 5 $((limit + 15)) taskset -c "$cpu" env LD_PRELOAD="$job/preload.so" \
  linux.uml mem="$memory" quiet rootfstype=hostfs rootflags=/ rw initcall_blacklist=raid6_select_algo lpj=20000000 \
  pty.legacy_count=0 con=null con0=null,fd:1 ssl=null init="$here/init.sh" GUEST_JOB="$job" GUEST_LIMIT="$guest_limit" \
  </dev/null >"$job/console" 2>&1
ended=$?
[ ! -f "$job/output" ] || cat "$job/output"
[ -z "${UML_DEBUG:-}" ] || cat "$job/console" >&2
[ ! -s "$job/status" ] || exit "$(cat "$job/status")"
[ -z "$virtual" ] || [ "$ended" != 124 ] || exit 124
cat "$job/console" >&2
die "the guest failed"
