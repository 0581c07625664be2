#!/bin/bash
# Runs a command in networks, mounts and processes of its own: what it leaves behind ends with it, however it ends.
#   tests/cell/run.sh COMMAND...
# An ordinary user has all of that as well, in a user namespace, but for what needs a disk of its own (rig/disk.py).
set -euo pipefail
own=()
[ "$(id -u)" -eq 0 ] || own=(--user --map-root-user)
export AXISD_CELL_RIG=1
exec unshare "${own[@]}" --net --mount --pid --fork --kill-child --mount-proc bash -c '
  set -e
  # Names of network namespaces are mounts: in a folder of its own they are nobody else'"'"'s.
  if mkdir -p /run/netns 2>/dev/null; then mount -t tmpfs names /run/netns; else mount -t tmpfs names /run && mkdir /run/netns; fi
  ip link set lo up
  "$@"' run.sh "$@"
