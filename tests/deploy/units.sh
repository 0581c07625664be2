#!/bin/bash
# The units of axisd, axisd-cell and its etcd under a real systemd, in a Debian 12 of its own that is booted in namespaces. As
# root, by hand; some minutes. What systemd takes from a process shows only here.
#   tests/deploy/units.sh [BUILD]      default: build/release; deploy/install.sh installs it there, and removes it
set -euo pipefail
cd "$(dirname "$(readlink -f "$0")")/../.."
export PATH=/usr/sbin:/usr/bin:/sbin:/bin

die() { echo "units.sh: $*" >&2; exit 1; }
step() { echo "== $*"; }
[ "$(id -u)" -eq 0 ] || die "run this as root: it makes a root file system"
build=$(readlink -f "${1:-build/release}")
command -v mmdebstrap >/dev/null || deploy/install-packages.sh package
scratch=$(mktemp -d "${TMPDIR:-/tmp}/axisd-units.XXXXXX")
root=$scratch/root
group=''  # of cgroups, which is the top of those that the other systemd sees
booted=''
clean_up() {
  local status=$?
  if [ "$status" -ne 0 ] && [ -n "$booted" ]; then
    inside journalctl --no-pager -u 'axisd*' 2>/dev/null | grep -v 'recognized and used' | tail -n 40 >&2 || true
  fi
  [ -z "$booted" ] || kill -KILL "$booted" 2>/dev/null || true
  wait 2>/dev/null || true
  if [ -n "$group" ]; then find "$group" -depth -type d -exec rmdir {} + 2>/dev/null || true; fi
  rm -rf --one-file-system "$scratch"
  exit "$status"
}
trap clean_up EXIT

step "a Debian 12"
sources=/etc/apt/sources.list.d/debian.sources
[ -f "$sources" ] || sources=/etc/apt/sources.list
libraries=$(sed -n 's/^run=(\(.*\))$/\1/p' deploy/install-packages.sh)
# shellcheck disable=SC2016  # it is expanded by mmdebstrap
mmdebstrap --quiet --variant=minbase \
  --include="systemd,systemd-sysv,dbus,iproute2,procps,openssl,etcd-server,etcd-client,${libraries// /,}" \
  --setup-hook='mkdir -p "$1/etc/systemd/system" && ln -s /dev/null "$1/etc/systemd/system/etcd.service"' \
  bookworm "$root" "$sources"
DESTDIR=$root BUILD=$build deploy/install.sh >/dev/null
install -D deploy/install.sh "$root/srv/axisd/deploy/install.sh"
mkdir -p "$root/etc/axisd"
cp deploy/axisd.yaml deploy/links "$root/etc/axisd"
echo '127.0.0.1 localhost' >"$root/etc/hosts"

step "booting it"
cat >"$scratch/boot" <<'END'
set -e
cd "$1"
mount --bind . .
cd "$1"
mount -t proc proc proc
mount -t sysfs sysfs sys
mount -t cgroup2 cgroup2 sys/fs/cgroup
mount -t tmpfs -o mode=755 run run
mount -t tmpfs tmp tmp
mount -t tmpfs -o mode=755 dev dev
for device in null zero full random urandom tty; do
  touch "dev/$device"
  mount --bind "/dev/$device" "dev/$device"
done
mkdir dev/pts dev/shm
mount -t devpts -o newinstance,ptmxmode=0666 devpts dev/pts
ln -s pts/ptmx dev/ptmx
ln -s /proc/self/fd dev/fd
ip link set lo up
ip address add 10.9.0.1/32 dev lo
mkdir -p old
pivot_root . old
umount -l /old
mount --make-rshared /
exec env -i container=axisd PATH=/usr/sbin:/usr/bin:/sbin:/bin /sbin/init
END
top=$(findmnt --noheadings --types cgroup2 --output TARGET | head -n 1)
[ -n "$top" ] || die "there is no cgroup2 here"
group=$top/axisd-units.$$
mkdir "$group"
(
  echo "$BASHPID" >"$group/cgroup.procs"
  exec unshare --pid --mount --cgroup --uts --ipc --net --fork --kill-child bash "$scratch/boot" "$root"
) >"$scratch/console" 2>&1 &
outside=$!
for _ in $(seq 100); do
  booted=$(pgrep -P "$outside") && [ "$(cat "/proc/$booted/comm")" = systemd ] && break
  kill -0 "$outside" || { cat "$scratch/console"; die "it did not boot"; }
  sleep 0.1
done
inside() { nsenter --target "$booted" --mount --pid --uts --ipc --net --cgroup env -i PATH="$PATH" HOME=/root "$@"; }
eventually() { for _ in $(seq 300); do "$@" >/dev/null 2>&1 && return 0; sleep 0.2; done; die "in vain: $*"; }
eventually inside systemctl is-system-running --wait
active() { [ "$(inside systemctl is-active "$1")" = active ] || die "$1 is $(inside systemctl is-active "$1")"; }
process() { inside systemctl show --property MainPID --value "$1"; }

step "certificates"
inside /usr/share/axisd/cell/certificates.sh --dir /srv/pki --members press-1 hall press-1=10.9.0.1 >/dev/null
inside /usr/share/axisd/pki.sh --dir /srv/pki client shift-a >/dev/null
pki=$root/srv/pki
put() { install -D -m "$3" "$pki/$1" "$root/etc/axisd/$2"; }
for end in crt key; do
  put "etcd.press-1.$end" "etcd/server.$end" 600
  put "members/press-1.$end" "etcd/peer.$end" 600
  put "press-1.$end" "tls/server.$end" 644
  put "entrance.press-1.$end" "tls/entrance.$end" 600
  put "cell.press-1.$end" "tls/cell.$end" 600
done
put ca.crt etcd/clients.crt 644
put clients.crl etcd/clients.crl 644
put members/ca.crt etcd/members.crt 644
put members/clients.crl etcd/members.crl 644
put ca.crt tls/clients.crt 644
inside chown root:axisd /etc/axisd/tls/server.key
inside chmod 640 /etc/axisd/tls/server.key

step "etcd"
inside /usr/share/axisd/cell/member.sh --cell hall --name press-1 --members press-1=10.9.0.1
eventually inside systemctl is-active axisd-etcd
[ "$(inside systemctl is-enabled etcd.service || true)" = masked ] || die "Debian's etcd.service is not masked"
as_root=(env ETCDCTL_API=3 ETCDCTL_ENDPOINTS=https://10.9.0.1:2379 ETCDCTL_CACERT=/srv/pki/ca.crt
  ETCDCTL_CERT=/srv/pki/root.crt ETCDCTL_KEY=/srv/pki/root.key)
inside "${as_root[@]}" /usr/share/axisd/cell/roles.sh hall press-1
[ "$(inside ps -o user= -p "$(process axisd-etcd)")" = etcd ] || die "etcd runs as somebody else"
first=$(process axisd-etcd)
inside kill -KILL "$first"
eventually inside "${as_root[@]}" etcdctl endpoint health
[ "$(process axisd-etcd)" != "$first" ] || die "etcd was not started anew"

step "backup"
for file in ca.crt root.crt root.key; do put "$file" "etcd-backup/$file" 600; done
echo ETCDCTL_ENDPOINTS=https://10.9.0.1:2379 >"$root/etc/axisd/etcd-backup/endpoints"
inside systemctl start axisd-etcd-backup.service
inside systemctl enable --quiet --now axisd-etcd-backup.timer
compgen -G "$root/var/lib/private/axisd-etcd-backup/etcd-*.snapshot" >/dev/null || die "there is no snapshot"
[ "$(stat -c %a "$root/var/lib/private/axisd-etcd-backup")" = 700 ] || die "others can read the snapshots"

step "axisd"
sed -i 's/^machine: .*/machine: press-1/; s#^  listen: .*#  listen: 0.0.0.0:7443\n  tls: { certificate: /etc/axisd/tls/server.crt, key: /etc/axisd/tls/server.key, client_ca: /etc/axisd/tls/clients.crt }#' \
  "$root/etc/axisd/axisd.yaml"
cat >>"$root/etc/axisd/axisd.yaml" <<'END'
access:
  roles: { shift-a: maintainer, cell.hall: viewer }
  delegates: { cell.hall: maintainer }
END
inside axisd --check
inside systemctl start axisd
ctl() {  # PORT WORD...
  inside axisctl --server "10.9.0.1:$1" --tls-ca /srv/pki/ca.crt --tls-cert /srv/pki/shift-a.crt --tls-key /srv/pki/shift-a.key \
    --timeout 20s "${@:2}"
}
eventually ctl 7443 list
daemon=$(process axisd)

step "axisd-cell"
cat >"$root/etc/axisd/cell.yaml" <<'END'
cell: hall
machine: press-1
listen: 0.0.0.0:7445
advertise: 10.9.0.1:7445
tls:
  certificate: /etc/axisd/tls/server.crt
  key: /run/credentials/axisd-cell.service/server.key
  client_ca: /etc/axisd/tls/clients.crt
axisd:
  server: localhost:7443
  advertise: 10.9.0.1:7443
  tls:
    ca: /etc/axisd/tls/clients.crt
    certificate: /etc/axisd/tls/entrance.crt
    key: /run/credentials/axisd-cell.service/entrance.key
etcd:
  endpoints: [ 10.9.0.1:2379 ]
  tls: { ca: /etc/axisd/tls/clients.crt, certificate: /etc/axisd/tls/cell.crt, key: /run/credentials/axisd-cell.service/cell.key }
roles: { shift-a: maintainer }
END
chmod 644 "$root"/etc/axisd/tls/*.crt
mkdir -p "$root/etc/systemd/system/axisd-cell.service.d"
cat >"$root/etc/systemd/system/axisd-cell.service.d/keys.conf" <<'END'
[Service]
LoadCredential=server.key:/etc/axisd/tls/server.key
LoadCredential=entrance.key:/etc/axisd/tls/entrance.key
LoadCredential=cell.key:/etc/axisd/tls/cell.key
END
inside systemctl daemon-reload
inside systemctl enable --quiet --now axisd-cell
active axisd-cell
[ "$(inside ps -o user= -p "$(process axisd-cell)")" != root ] || die "axisd-cell runs as root"
eventually ctl 7445 list
registered() { inside "${as_root[@]}" etcdctl get --keys-only /axisd/hall/machines/press-1 | grep -q .; }
eventually registered
eventually ctl 7445 enable feeder --wait
ctl 7445 home feeder --wait

step "each ends alone"
first=$(process axisd-cell)
inside kill -KILL "$first"
eventually ctl 7445 list
[ "$(process axisd-cell)" != "$first" ] || die "axisd-cell was not started anew"
inside systemctl stop axisd-etcd
ctl 7445 move feeder 20mm --relative --velocity 20mm/s --wait
inside systemctl stop axisd-cell
ctl 7443 move feeder 20mm --relative --velocity 20mm/s --wait
[ "$(process axisd)" = "$daemon" ] || die "axisd was restarted"
[ "$(inside systemctl show --property Result --value axisd-cell)" = success ] || die "axisd-cell did not end in order"

step "uninstalling what runs"
inside systemctl enable --quiet --now axisd axisd-link.socket axisd-etcd axisd-cell
eventually ctl 7445 list
ctl 7443 move feeder 390mm --velocity 20mm/s
inside /srv/axisd/deploy/install.sh --uninstall >"$scratch/log" || { cat "$scratch/log"; die "it was not uninstalled"; }
inside journalctl --no-pager --unit axisd | grep -q 'stopping what moves: feeder' || die "the moving axis was not stopped"
! inside pgrep --list-name '^(axisd|etcd)' || die "it still runs"
left=$(find "$root/etc/systemd/system" "$root/usr" \( -name '*axisd*' -o -name '*axisctl*' \) ! -path '*/etc/systemd/system/*.d*')
[ -z "$left" ] || die "that is left: $left"
[ -f "$root/etc/axisd/axisd.yaml" ] && [ -d "$root/var/lib/axisd" ] || die "configuration or state is gone"
echo "units: ok"
