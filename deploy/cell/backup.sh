#!/bin/bash
# Writes a snapshot of a cell's etcd, checks that it is whole, and keeps the newest of them (docs/cell.md).
#   backup.sh [--keep N] DIRECTORY       N: how many (default: 14)
# With root's certificate, in the environment of etcdctl, as for roles.sh. Each endpoint is tried until one answers.
set -euo pipefail
umask 077
export ETCDCTL_API=3

die() { echo "backup.sh: $*" >&2; exit 1; }
keep=14
if [ "${1:-}" = --keep ]; then
  [[ ${2:-} =~ ^[1-9][0-9]{0,3}$ ]] || die "--keep: give 1 to 9999"
  keep=$2
  shift 2
fi
[ $# -eq 1 ] || { sed -n '3,4s/^# \{0,3\}//p' "$(readlink -f "$0")" >&2; exit 2; }
[ -n "${ETCDCTL_ENDPOINTS:-}" ] || die "ETCDCTL_ENDPOINTS names no member"
mkdir -p "$1"
cd "$1"

# etcdctl takes a snapshot of one endpoint only.
IFS=, read -r -a endpoints <<<"$ETCDCTL_ENDPOINTS"
unset ETCDCTL_ENDPOINTS
trap 'rm -f .new .new.part .said' EXIT
from=''
for endpoint in "${endpoints[@]}"; do
  rm -f .new .new.part
  # Asked of a member that is not there, a snapshot is waited for without end.
  if etcdctl --endpoints "$endpoint" --command-timeout 5s endpoint health >.said 2>&1 &&
      timeout 300 etcdctl --endpoints "$endpoint" snapshot save .new >.said 2>&1; then
    from=$endpoint
    break
  fi
  echo "backup.sh: $endpoint: $(tail -n 1 .said)" >&2
done
[ -n "$from" ] || die "no member gave a snapshot"
etcdctl snapshot status .new >.said 2>&1 || die "the snapshot of $from is not whole: $(tail -n 1 .said)"
name=etcd-$(date -u +%Y%m%dT%H%M%SZ).snapshot
mv .new "$name"
sync -f "$name"
echo "$PWD/$name: of $from: $(cat .said)"
find . -maxdepth 1 -name 'etcd-*.snapshot' -printf '%f\n' | sort -r | tail -n +$((keep + 1)) | xargs -r rm --
