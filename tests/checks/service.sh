#!/bin/bash
# Stages an installation of BUILD and checks what systemd will read: the unit (syntax, programs, exposure), the catalog and the
# user.
#   tests/checks/service.sh BUILD
set -euo pipefail
build=$(readlink -f "${1:?"usage: tests/checks/service.sh BUILD"}")
command -v systemd-analyze >/dev/null ||
  { echo "service.sh: no systemd-analyze: install the package systemd (deploy/install-packages.sh test)" >&2; exit 1; }

stage=$(mktemp -d "${TMPDIR:-/tmp}/axisd-service.XXXXXX")
trap 'rm -rf "$stage"' EXIT
DESTDIR=$stage cmake --install "$build" --prefix /usr >/dev/null
for program in axisd axisctl axisd-sim axisd-web axisd-cell; do
  [ -x "$stage/usr/bin/$program" ] || { echo "service.sh: $program is not installed" >&2; exit 1; }
done

[ -x "$stage/usr/lib/axisd/axisd-link" ] || { echo "service.sh: axisd-link is not installed" >&2; exit 1; }

# The units name /usr; this computer has the programs elsewhere.
mkdir "$stage/unit"
for unit in axisd.service axisd-link.service axisd-link.socket axisd-web.service axisd-cell.service axisd-etcd.service \
    axisd-etcd-backup.service axisd-etcd-backup.timer; do
  sed "s#/usr/\(bin\|lib/axisd\|share/axisd/cell\)/\(axisd\|backup\)#$stage/usr/\1/\2#" "$stage/usr/lib/systemd/system/$unit" >"$stage/unit/$unit"
done
complaints=$(systemd-analyze verify --man=no "$stage"/unit/axisd* 2>&1) || { echo "$complaints"; exit 1; }
if grep -E 'axisd(-link|-web|-cell|-etcd|-etcd-backup)?\.(service|socket|timer)' <<<"$complaints"; then exit 1; fi

# 10 is without any protection; beyond 1.6 somebody has opened something. Also with the example of a drop-in.
mkdir "$stage/unit/axisd.service.d"
cp "$stage/usr/share/doc/axisd/examples/axisd-networks.conf" "$stage/unit/axisd.service.d"
for unit in "$stage/usr/lib/systemd/system/axisd.service" "$stage/unit/axisd.service" "$stage/unit/axisd-link.service"; do
  systemd-analyze security --offline=true --threshold=16 "$unit" >"$stage/exposure" ||
    { cat "$stage/exposure"; exit 1; }
  tail -n 1 "$stage/exposure"
done
# The catalog has each kind of line that the daemon's journal knows, and no other.
mkdir -p "$stage/var/lib/systemd/catalog"
journalctl --root="$stage" --update-catalog
ids=$(dirname "$0")/../../buses/log_about.cpp
diff <(grep -o '"[0-9a-f]\{32\}"' "$ids" | tr -d '"' | sort) \
  <(journalctl --root="$stage" --list-catalog | cut -d ' ' -f 1 | sort) ||
  { echo "service.sh: deploy/axisd.catalog lacks kinds (<) of $ids, or has others (>)" >&2; exit 1; }

# What it may not be closed to: serial ports and CAN.
for needed in '^DeviceAllow=char-ttyUSB rw$' '^DeviceAllow=char-ttyACM rw$' '^DeviceAllow=char-ttyS rw$' \
  '^RestrictAddressFamilies=.*AF_CAN' '^RestrictAddressFamilies=.*AF_INET ' '^WatchdogSec=1$' '^WatchdogSignal=SIGKILL$' \
  '^ExecStopPost=-/usr/bin/axisd --quiesce ' '^RestartPreventExitStatus=2$'; do
  grep -q "$needed" "$stage/usr/lib/systemd/system/axisd.service" || { echo "axisd.service has no line $needed" >&2; exit 1; }
done

for unit in axisd-web axisd-cell axisd-etcd axisd-etcd-backup; do
  systemd-analyze security --offline=true --threshold=13 "$stage/unit/$unit.service" >"$stage/exposure" ||
    { cat "$stage/exposure"; exit 1; }
  tail -n 1 "$stage/exposure"
done
# axisd needs nothing of the cell, and none of its stops ends with it.
! grep -q 'axisd-cell\|etcd' "$stage/usr/lib/systemd/system/axisd.service" ||
  { echo "service.sh: axisd.service names the cell" >&2; exit 1; }
! grep -Eq '^(Requires|BindsTo|PartOf|Requisite)=' "$stage/unit/axisd-cell.service" ||
  { echo "service.sh: axisd-cell.service binds itself to another unit" >&2; exit 1; }
systemd-sysusers --dry-run "$stage/usr/lib/sysusers.d/axisd.conf"
