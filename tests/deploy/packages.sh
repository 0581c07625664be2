#!/bin/bash
# Makes the packages, looks into them, and installs, upgrades, removes and purges them in a Debian 12 of its own, in
# which the simulated axis of /etc/axisd/axisd.yaml moves. As root; some minutes, and more where ccache is empty.
#   tests/deploy/packages.sh [DIRECTORY]     with packages that are made already
#   tests/deploy/packages.sh --twice         also makes them again without ccache, elsewhere: the same bytes
# There is no systemd in that Debian: `systemctl` and `deb-systemd-invoke` are scripts there, which start and stop the
# daemon as the unit does and note what they were asked for.
set -euo pipefail
cd "$(dirname "$(readlink -f "$0")")/../.."
deploy/install-packages.sh package
export PATH=/usr/sbin:/usr/bin:/sbin:/bin

die() { echo "packages.sh: $*" >&2; exit 1; }
step() { echo "== $*"; }
[ "$(id -u)" -eq 0 ] || die "run this as root: it makes a root file system"
scratch=$(mktemp -d "${TMPDIR:-/tmp}/axisd-packages.XXXXXX")
root=$scratch/root
holder=''  # of a network of its own, in which no other daemon has the port
inside() {
  nsenter "--net=/proc/$holder/ns/net" chroot "$root" env -i PATH="$PATH" HOME=/root DEBIAN_FRONTEND=noninteractive LC_ALL=C.UTF-8 "$@"
}
clean_up() {
  local status=$?
  [ ! -s "$root/run/axisd.pid" ] || kill -KILL "$(cat "$root/run/axisd.pid")" 2>/dev/null || true
  [ -z "$holder" ] || kill "$holder"
  for mounted in proc dev; do mountpoint -q "$root/$mounted" && umount -l "$root/$mounted"; done
  rm -rf --one-file-system "$scratch"
  exit "$status"
}
trap clean_up EXIT

case "${1:-}" in
  '' | --twice)
    packages=$scratch/packages
    step "making packages"
    deploy/package.sh "$packages"
    ;;
  *) packages=$(readlink -f "$1") ;;
esac
if [ "${1:-}" = --twice ]; then
  step "making them again"
  mkdir "$scratch/elsewhere" "$scratch/elsewhere/a-folder-with-a-longer-name"
  git clone -q . "$scratch/elsewhere/clone"
  TMPDIR=$scratch/elsewhere/a-folder-with-a-longer-name CCACHE_DISABLE=1 LINTIAN=no TZ=Asia/Tokyo LANG=C \
    "$scratch/elsewhere/clone/deploy/package.sh" "$scratch/again"
  for package in "$packages"/*.deb; do
    cmp "$package" "$scratch/again/$(basename "$package")" || die "not reproducible"
  done
fi

step "contents"
one() { local found=("$packages/$1"_*.deb); echo "${found[0]}"; }
has() {  # PACKAGE PATH ...
  local package=$1 path list
  list=$(dpkg-deb -c "$(one "$package")" | awk '{print $6}')
  shift
  for path in "$@"; do grep -qx "\./$path" <<<"$list" || die "$package has no /$path"; done
}
has axisd usr/share/axisd/pki.sh usr/bin/axisd usr/bin/axisd-sim usr/bin/axisd-web usr/lib/axisd/axisd-link \
  etc/axisd/axisd.yaml etc/axisd/links etc/axisd/web.yaml lib/systemd/system/axisd.service lib/systemd/system/axisd-web.service \
  lib/systemd/system/axisd-link.socket usr/lib/sysusers.d/axisd.conf usr/lib/tmpfiles.d/axisd.conf \
  usr/lib/systemd/catalog/axisd.catalog lib/udev/rules.d/99-axisd.rules usr/share/man/man8/axisd.8.gz \
  usr/share/man/man8/axisd-link.8.gz usr/share/man/man1/axisd-sim.1.gz usr/share/man/man5/axisd.yaml.5.gz
has axisctl usr/bin/axisctl usr/share/man/man1/axisctl.1.gz usr/share/bash-completion/completions/axisctl \
  usr/share/zsh/vendor-completions/_axisctl usr/share/fish/vendor_completions.d/axisctl.fish
has python3-axisd usr/lib/python3/dist-packages/axisd/__init__.py usr/lib/python3/dist-packages/axisd/py.typed \
  usr/lib/python3/dist-packages/axisd/v1/axis_service_pb2_grpc.py
has axisd-doc usr/share/axisd/proto/axisd/v1/axis_service.proto usr/share/doc/axisd/api.html
conffiles=$(dpkg-deb -I "$(one axisd)" conffiles | sort | xargs)
[ "$conffiles" = "/etc/axisd/axisd.yaml /etc/axisd/links /etc/axisd/web.yaml" ] || die "conffiles of axisd: $conffiles"

step "a Debian 12"
needed=$(for package in axisd axisctl python3-axisd; do dpkg-deb -f "$(one "$package")" Depends | tr ',' '\n' |
  sed 's/[ (|].*//; s/^ *//; /^axis/d; /^$/d'; done | sort -u | paste -sd,)
sources=/etc/apt/sources.list.d/debian.sources
[ -f "$sources" ] || sources=/etc/apt/sources.list
mmdebstrap --quiet --variant=minbase --include="$needed,procps" bookworm "$root" "$sources"
unshare --net sleep infinity &
holder=$!
until nsenter "--net=/proc/$holder/ns/net" ip link set lo up 2>/dev/null; do sleep 0.1; done
echo '127.0.0.1 localhost' >"$root/etc/hosts"
mount --bind /dev "$root/dev"
mount -t proc proc "$root/proc"
mkdir -p "$root/run/systemd/system" "$root/packages"
cp "$packages"/*.deb "$root/packages"
for program in systemctl deb-systemd-invoke; do
  cat >"$root/usr/local/bin/$program" <<'EOF'
#!/bin/bash
echo "$(basename "$0") $*" >>/var/tmp/asked
alive() { [ -s /run/axisd.pid ] && kill -0 "$(cat /run/axisd.pid)" 2>/dev/null; }
start() {
  alive && return
  setpriv --reuid axisd --regid axisd --init-groups /usr/bin/axisd --config /etc/axisd/axisd.yaml >>/var/tmp/log 2>&1 &
  echo $! >/run/axisd.pid
}
stop() {
  alive || return 0
  kill -TERM "$(cat /run/axisd.pid)"
  while alive; do sleep 0.1; done
  setpriv --reuid axisd --regid axisd --init-groups /usr/bin/axisd --quiesce /etc/axisd/axisd.yaml >>/var/tmp/log 2>&1
  return 0
}
case "$*" in
  *is-active*axisd.service*) alive ;;
  *is-active*axisd-web.service*) [ -e /run/axisd-web.on ] ;;
  *show*MainPID*) cat /run/axisd.pid ;;
  *restart*axisd.service*) stop; start ;;
  *start*axisd.service*) start ;;
  *stop*axisd.service*) stop ;;
esac
EOF
  chmod +x "$root/usr/local/bin/$program"
done
PATH=/usr/local/bin:$PATH
snapshot() { (cd "$root" && find etc usr var lib run -xdev \( -path var/lib/dpkg -o -path var/cache -o -path var/log \
  -o -path var/tmp -o -path run/systemd -o -name '*-' \) -prune -o -print | sort); }
ctl() { inside axisctl --timeout 20s "$@"; }
eventually() { for _ in $(seq 300); do "$@" >/dev/null 2>&1 && return 0; sleep 0.1; done; die "in vain: $*"; }

snapshot >"$scratch/before"
step "installing"
inside dpkg -i /packages/axisd_*.deb /packages/axisctl_*.deb /packages/python3-axisd_*.deb >"$scratch/log" ||
  { cat "$scratch/log"; die "dpkg -i failed"; }
inside getent passwd axisd >/dev/null || die "there is no user axisd"
[ "$(inside stat -c '%U:%G %a' /var/lib/axisd)" = "axisd:axisd 750" ] || die "/var/lib/axisd is not the daemon's"
eventually ctl list
eventually ctl enable feeder --wait
ctl home feeder --wait
ctl move feeder 120mm --velocity 50mm/s --wait
inside /usr/bin/python3 -B -c '
import asyncio, axisd
async def main():
    async with axisd.connect("localhost:7443") as machine:
        print((await machine.axis("feeder").state()).position)
asyncio.run(main())' || die "the Python client does not work"

step "an upgrade under way"
upgrade() {  # SUFFIX: the same packages as a later version
  for package in axisd axisctl; do
    rm -rf "$scratch/later"
    dpkg-deb -R "$(one "$package")" "$scratch/later"
    sed -i "s/^Version: .*/&$1/" "$scratch/later/DEBIAN/control"
    dpkg-deb --root-owner-group -Znone -b "$scratch/later" "$root/packages/later-$package.deb" >/dev/null
  done
  inside dpkg -i /packages/later-axisd.deb /packages/later-axisctl.deb >"$scratch/log" 2>&1 ||
    { cat "$scratch/log"; die "the upgrade failed"; }
}
sed -i 's/^machine: .*/machine: changed/' "$root/etc/axisd/axisd.yaml"
ctl move feeder 390mm --velocity 20mm/s
sleep 1
first=$(cat "$root/run/axisd.pid")
touch "$root/run/axisd-web.on"
upgrade +later1
grep -q 'restart axisd-web.service' "$root/var/tmp/asked" || { cat "$scratch/log"; die "the old axisd-web still runs"; }
rm "$root/run/axisd-web.on"
grep -q '^axisd: restarting. What moves' "$scratch/log" || { cat "$scratch/log"; die "the upgrade did not say that it restarts axisd"; }
[ "$(cat "$root/run/axisd.pid")" != "$first" ] || die "the old daemon still runs"
grep -q 'stopping what moves: feeder' "$root/var/tmp/log" || die "the moving axis was not stopped"
grep -q '^machine: changed' "$root/etc/axisd/axisd.yaml" || die "the upgrade overwrote the configuration"
eventually ctl list
eventually ctl enable feeder --wait
# That positions outlast a restart is tests/e2e/test_kept_state.py's: this drive was simulated by the daemon that ended.

step "an upgrade that does not take the configuration"
sed -i 's/^machine: .*/machnie: wrong/' "$root/etc/axisd/axisd.yaml"
second=$(cat "$root/run/axisd.pid")
upgrade +later2
grep -q 'goes on running' "$scratch/log" || { cat "$scratch/log"; die "nothing was said of the configuration"; }
[ "$(cat "$root/run/axisd.pid")" = "$second" ] && kill -0 "$second" || die "the daemon was restarted all the same"
sed -i 's/^machnie: .*/machine: right/' "$root/etc/axisd/axisd.yaml"

step "an upgrade of a daemon that does not run"
inside deb-systemd-invoke stop axisd.service
upgrade +later3
! kill -0 "$second" 2>/dev/null || die "the daemon was not stopped"
[ "$(cat "$root/run/axisd.pid")" = "$second" ] || die "an upgrade started the daemon"
inside deb-systemd-invoke start axisd.service
eventually ctl list

running() { kill -0 "$(cat "$root/run/axisd.pid")" 2>/dev/null; }
step "removing, and installing again"
inside dpkg -r axisd python3-axisd >"$scratch/log" 2>&1 || { cat "$scratch/log"; die "dpkg -r failed"; }
! running || die "the daemon still runs"
grep -q 'stop axisd-web.service' "$root/var/tmp/asked" || die "axisd-web was not stopped"
[ -d "$root/var/lib/axisd" ] && [ -f "$root/etc/axisd/axisd.yaml" ] || die "removing took configuration or state"
inside dpkg -i /packages/later-axisd.deb >"$scratch/log" 2>&1 || { cat "$scratch/log"; die "dpkg -i failed"; }
eventually ctl list
running || die "the daemon was not started"

step "purging"
mkdir -p "$root/var/lib/private/axisd-web"
touch "$root/var/lib/private/axisd-web/users"
ln -s private/axisd-web "$root/var/lib/axisd-web"
inside dpkg -P axisd axisctl python3-axisd >"$scratch/log" 2>&1 || { cat "$scratch/log"; die "dpkg -P failed"; }
! running || die "the daemon still runs"
rm -f "$root/run/axisd.pid"
! inside getent passwd axisd >/dev/null || die "the user is left"
rmdir "$root/var/lib/private" || die "purging left the users of the page"
snapshot >"$scratch/after"
diff "$scratch/before" "$scratch/after" || die "purging left something (>), or took something (<)"
echo "packages: ok"
