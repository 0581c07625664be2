#!/bin/bash
# Makes the packages, looks into them, and installs, upgrades, restores, removes and purges them in a Debian 12 of its own,
# in which the simulated axis of /etc/axisd/axisd.yaml moves, also over TLS. As root; some minutes, and more where ccache is
# empty.
#   tests/deploy/packages.sh [DIRECTORY]     with packages that are made already
#   tests/deploy/packages.sh --twice         also makes them again without ccache, elsewhere: the same bytes
# There is no systemd in that Debian: `systemctl` and `deb-systemd-invoke` are scripts there, which start and stop axisd and
# axisd-web as their units do.
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
  for unit in axisd axisd-web axisd-cell; do
    [ ! -s "$root/run/$unit.pid" ] || kill -KILL "$(cat "$root/run/$unit.pid")" 2>/dev/null || true
  done
  [ -z "$holder" ] || kill "$holder"
  for mounted in proc dev/pts dev; do mountpoint -q "$root/$mounted" && umount -l "$root/$mounted"; done
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
has axisd usr/share/axisd/pki.sh usr/bin/axisd usr/bin/axisd-sim usr/lib/axisd/axisd-link \
  etc/axisd/axisd.yaml etc/axisd/links lib/systemd/system/axisd.service lib/systemd/system/axisd-link.service \
  lib/systemd/system/axisd-link.socket usr/lib/sysusers.d/axisd.conf usr/lib/tmpfiles.d/axisd.conf \
  usr/lib/systemd/catalog/axisd.catalog lib/udev/rules.d/99-axisd.rules usr/share/man/man8/axisd.8.gz \
  usr/share/man/man8/axisd-link.8.gz usr/share/man/man1/axisd-sim.1.gz usr/share/man/man5/axisd.yaml.5.gz
has axisd-cell usr/bin/axisd-cell etc/axisd/cell.yaml lib/systemd/system/axisd-cell.service \
  lib/systemd/system/axisd-etcd.service lib/systemd/system/axisd-etcd-backup.service lib/systemd/system/axisd-etcd-backup.timer \
  usr/share/man/man8/axisd-cell.8.gz usr/share/axisd/cell/certificates.sh usr/share/axisd/cell/member.sh \
  usr/share/axisd/cell/roles.sh usr/share/axisd/cell/backup.sh usr/share/axisd/cell/demo.sh
has axisctl usr/bin/axisctl usr/share/man/man1/axisctl.1.gz usr/share/bash-completion/completions/axisctl \
  usr/share/zsh/vendor-completions/_axisctl usr/share/fish/vendor_completions.d/axisctl.fish
has axisd-web usr/bin/axisd-web etc/axisd/web.yaml lib/systemd/system/axisd-web.service usr/share/axisd-web/index.html \
  usr/share/axisd-web/index.html.gz usr/share/man/man8/axisd-web.8.gz
has python3-axisd usr/lib/python3/dist-packages/axisd/__init__.py usr/lib/python3/dist-packages/axisd/py.typed \
  usr/lib/python3/dist-packages/axisd/v1/axis_service_pb2_grpc.py
has axisd-doc usr/share/axisd/proto/axisd/v1/axis_service.proto usr/share/doc/axisd/api.html
conffiles() { dpkg-deb -I "$(one "$1")" conffiles | sort | xargs; }
[ "$(conffiles axisd)" = "/etc/axisd/axisd.yaml /etc/axisd/links" ] || die "conffiles of axisd: $(conffiles axisd)"
[ "$(conffiles axisd-web)" = /etc/axisd/web.yaml ] || die "conffiles of axisd-web: $(conffiles axisd-web)"
[ "$(conffiles axisd-cell)" = /etc/axisd/cell.yaml ] || die "conffiles of axisd-cell: $(conffiles axisd-cell)"

step "a Debian 12"
needed=$(for package in axisd axisctl axisd-web axisd-cell python3-axisd; do dpkg-deb -f "$(one "$package")" Depends | tr ',' '\n' |
  sed 's/^ *//; s/[ (|].*//; /^axis/d; /^$/d'; done | sort -u | paste -sd,)
sources=/etc/apt/sources.list.d/debian.sources
[ -f "$sources" ] || sources=/etc/apt/sources.list
mmdebstrap --quiet --variant=minbase --include="$needed,openssl,procps" bookworm "$root" "$sources"
unshare --net sleep infinity &
holder=$!
while [ "$(readlink "/proc/$holder/ns/net")" = "$(readlink /proc/self/ns/net)" ]; do sleep 0.1; done
nsenter "--net=/proc/$holder/ns/net" ip link set lo up
echo '127.0.0.1 localhost' >"$root/etc/hosts"
mount --bind /dev "$root/dev"
mount --make-private "$root/dev"
mount --bind /dev/pts "$root/dev/pts"  # the simulated drive's line
mount -t proc proc "$root/proc"
mkdir -p "$root/run/systemd/system" "$root/packages"
install -d -m 711 "$root/var/lib/private"  # systemd keeps it to itself, and mounts what is in it for each service
cp "$packages"/*.deb "$root/packages"
for program in systemctl deb-systemd-invoke; do
  cat >"$root/usr/local/bin/$program" <<'EOF'
#!/bin/bash
unit() {  # VERB NAME
  local verb=$1 name=$2
  local pid=/run/$name.pid
  alive() { [ -s "$pid" ] && kill -0 "$(cat "$pid")" 2>/dev/null; }
  start() {
    alive && return
    case $name in
      axisd) setpriv --reuid axisd --regid axisd --init-groups /usr/bin/axisd --config /etc/axisd/axisd.yaml >>/var/tmp/log 2>&1 & ;;
      axisd-web)  # its user and its state directory, as DynamicUser= makes them
        install -d -o 61184 -g 61184 -m 700 /var/lib/private/axisd-web
        ln -sfn private/axisd-web /var/lib/axisd-web
        setpriv --reuid 61184 --regid 61184 --clear-groups /usr/bin/axisd-web >>/var/tmp/web-log 2>&1 &
        ;;
      axisd-cell)
        install -d -o nobody -m 700 /var/lib/private/axisd-cell
        ln -sfn private/axisd-cell /var/lib/axisd-cell
        setpriv --reuid nobody --regid nogroup --clear-groups /usr/bin/axisd-cell --config /etc/axisd/cell.yaml >>/var/tmp/cell-log 2>&1 &
        ;;
    esac
    echo $! >"$pid"
  }
  stop() {
    alive || return 0
    kill -TERM "$(cat "$pid")"
    while alive; do sleep 0.1; done
    [ "$name" != axisd ] ||
      setpriv --reuid axisd --regid axisd --init-groups /usr/bin/axisd --quiesce /etc/axisd/axisd.yaml >>/var/tmp/log 2>&1
    return 0
  }
  case $verb in
    is-active) alive ;;
    show) cat "$pid" ;;
    restart) stop; start ;;
    start) start ;;
    stop) stop ;;
  esac
}
verb='' status=0
for word in "$@"; do
  case $word in
    is-active | is-enabled | show | restart | start | stop) verb=$word ;;
    axisd.service | axisd-web.service | axisd-cell.service) unit "$verb" "${word%.service}" || status=$? ;;
  esac
done
exit "$status"
EOF
  chmod +x "$root/usr/local/bin/$program"
done
PATH=/usr/local/bin:$PATH
snapshot() { (cd "$root" && find etc usr var lib run -xdev \( -path var/lib/dpkg -o -path var/cache -o -path var/log \
  -o -path var/tmp -o -path run/systemd -o -name '*-' \) -prune -o -print | sort); }
trusted=()  # whom axisctl trusts, and as whom it comes
ctl() { inside axisctl --timeout 20s "${trusted[@]}" "$@"; }
service() { inside systemctl "$1" "${2:-axisd}.service"; }
pid_of() { cat "$root/run/$1.pid"; }
running() { kill -0 "$(pid_of "${1:-axisd}")" 2>/dev/null; }
eventually() {
  for _ in $(seq 300); do
    "$@" >"$scratch/last" 2>&1 && return 0
    sleep 0.1
  done
  cat "$scratch/last" >&2
  tail -n 20 "$root"/var/tmp/*log >&2
  die "in vain: $*"
}

snapshot >"$scratch/before"
step "installing"
inside sh -c 'dpkg -i /packages/axisd_*.deb /packages/axisctl_*.deb /packages/axisd-web_*.deb /packages/python3-axisd_*.deb' \
  >"$scratch/log" 2>&1 || { cat "$scratch/log"; die "dpkg -i failed"; }
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

step "the entrance of a cell"
inside dpkg -i "/packages/$(basename "$(one axisd-cell)")" >"$scratch/log" 2>&1 || { cat "$scratch/log"; die "dpkg -i failed"; }
[ ! -e "$root/run/axisd-cell.pid" ] || die "installing it started it"
inside deb-systemd-invoke start axisd-cell.service
entrance() { inside axisctl --timeout 20s --server localhost:7445 "$@"; }
eventually entrance list
daemon=$(pid_of axisd) first=$(pid_of axisd-cell)
entrance move feeder 20mm --velocity 20mm/s
rm -rf "$scratch/later"
dpkg-deb -R "$(one axisd-cell)" "$scratch/later"
sed -i "s/^Version: .*/&+later/" "$scratch/later/DEBIAN/control"
dpkg-deb --root-owner-group -Znone -b "$scratch/later" "$root/packages/later-axisd-cell.deb" >/dev/null
inside dpkg -i /packages/later-axisd-cell.deb >"$scratch/log" 2>&1 || { cat "$scratch/log"; die "the upgrade failed"; }
grep -q '^axisd-cell: restarting the entrance' "$scratch/log" || { cat "$scratch/log"; die "the old axisd-cell still runs"; }
[ "$(pid_of axisd-cell)" != "$first" ] || die "the old axisd-cell still runs"
[ "$(pid_of axisd)" = "$daemon" ] || die "the upgrade of the entrance restarted axisd"
eventually entrance list
second=$(pid_of axisd-cell)
sed -i 's/^listen: /lisen: /' "$root/etc/axisd/cell.yaml"
inside dpkg -i "/packages/$(basename "$(one axisd-cell)")" >"$scratch/log" 2>&1 || { cat "$scratch/log"; die "the downgrade failed"; }
grep -q 'goes on running' "$scratch/log" || { cat "$scratch/log"; die "nothing was said of its configuration"; }
[ "$(pid_of axisd-cell)" = "$second" ] && kill -0 "$second" || die "it was restarted all the same"
sed -i 's/^lisen: /listen: /' "$root/etc/axisd/cell.yaml"
inside dpkg -r axisd-cell >"$scratch/log" 2>&1 || { cat "$scratch/log"; die "dpkg -r failed"; }
! kill -0 "$second" 2>/dev/null || die "axisd-cell still runs"
[ -e "$root/etc/axisd/cell.yaml" ] && [ -d "$root/var/lib/private/axisd-cell" ] || die "removing took configuration or state"
[ "$(pid_of axisd)" = "$daemon" ] && kill -0 "$daemon" || die "removing the entrance ended axisd"
mkdir -p "$root/var/lib/axisd-etcd/data"
inside dpkg -P axisd-cell >"$scratch/log" 2>&1 || { cat "$scratch/log"; die "dpkg -P failed"; }
rm -f "$root/run/axisd-cell.pid"
for left in /etc/axisd/cell.yaml /var/lib/axisd-cell /var/lib/private/axisd-cell /var/lib/axisd-etcd; do
  ! [ -e "$root$left" ] && ! [ -L "$root$left" ] || die "purging axisd-cell left $left"
done

step "the page"
look_at_page() {
  inside /usr/bin/python3 -B -c '
import http.client
def ask(method, path, body=None, **headers):
    connection = http.client.HTTPConnection("localhost", 7480, timeout=20)
    connection.request(method, path, body, headers)
    answer = connection.getresponse()
    return answer.status, answer.read()
status, page = ask("GET", "/")
assert status == 200, page
script = page.decode().split("src=\"", 1)[1].split("\"", 1)[0]
status, text = ask("GET", script)
assert status == 200 and len(text) > 100_000, (script, status, len(text))
status, axes = ask("POST", "/axisd.v1.AxisService/ListAxes", bytes(5), **{
    "content-type": "application/grpc-web+proto", "origin": "http://localhost:7480"})
assert status == 200 and b"feeder" in axes and b"grpc-status: 0" in axes, axes'
}
eventually look_at_page
echo long-enough-for-a-password | inside axisd-web user add shift-a --role operator || die "there is no user of the page"
[ "$(inside stat -c '%u %a' /var/lib/private/axisd-web/users)" = "61184 600" ] || die "axisd-web cannot read its users"
inside axisd-web user remove shift-a

step "over TLS, by roles"
pki() { inside /usr/share/axisd/pki.sh --dir /var/tmp/cell "$@" >/dev/null; }
pki init cell-1
pki server press-1 localhost
for client in shift-a panel-1 service-1; do pki client "$client"; done
inside install -d -o root -g axisd -m 750 /etc/axisd/tls
inside install -o root -g axisd -m 640 /var/tmp/cell/press-1.key /etc/axisd/tls/server.key
inside install -o root -g axisd -m 644 /var/tmp/cell/press-1.crt /etc/axisd/tls/server.crt
inside install -o root -g axisd -m 644 /var/tmp/cell/ca.crt /etc/axisd/tls/clients.crt
inside install -o root -g axisd -m 644 /var/tmp/cell/clients.crl /etc/axisd/tls/clients.crl
sed -i 's#^  listen: .*#  listen: 0.0.0.0:7443\n  tls: { certificate: /etc/axisd/tls/server.crt, key: /etc/axisd/tls/server.key, client_ca: /etc/axisd/tls/clients.crt, crl: /etc/axisd/tls/clients.crl }#' \
  "$root/etc/axisd/axisd.yaml"
echo 'access: { roles: { shift-a: operator, panel-1: viewer, service-1: maintainer } }' >>"$root/etc/axisd/axisd.yaml"
inside axisd --check || die "that configuration has errors"
service restart
as() { trusted=(--server localhost:7443 --tls-ca /var/tmp/cell/ca.crt --tls-cert "/var/tmp/cell/$1.crt" --tls-key "/var/tmp/cell/$1.key"); }
ready() {  # an operator has the axis homed and enabled
  as shift-a
  eventually ctl enable feeder --wait
  ctl home feeder --wait
}
ready
ctl move feeder 120mm --velocity 50mm/s --wait || die "an operator cannot move the axis"
as panel-1
ctl list >/dev/null || die "a viewer cannot look"
refused=$(ctl move feeder 10mm 2>&1) && die "a viewer moved the axis"
grep -q operator <<<"$refused" || die "that says not which role is missing: $refused"
ctl stop feeder || die "a viewer cannot stop the axis"
trusted=()
! ctl list >"$scratch/log" 2>&1 || die "somebody without a certificate got in"

step "an upgrade under way"
later=0
upgrade() {  # the same packages as a later version
  later=$((later + 1))
  for package in axisd axisctl axisd-web; do
    rm -rf "$scratch/later"
    dpkg-deb -R "$(one "$package")" "$scratch/later"
    sed -i "s/^Version: .*/&+later$later/" "$scratch/later/DEBIAN/control"
    dpkg-deb --root-owner-group -Znone -b "$scratch/later" "$root/packages/later-$package.deb" >/dev/null
  done
  inside dpkg -i /packages/later-axisd.deb /packages/later-axisctl.deb /packages/later-axisd-web.deb >"$scratch/log" 2>&1 ||
    { cat "$scratch/log"; die "the upgrade failed"; }
}
said() { grep -q "$1" "$scratch/log" || { cat "$scratch/log"; die "$2"; }; }
sed -i 's/^machine: .*/machine: changed/' "$root/etc/axisd/axisd.yaml"
ready
ctl move feeder 390mm --velocity 20mm/s
sleep 1
first=$(pid_of axisd) page=$(pid_of axisd-web)
upgrade
said '^axisd: restarting. What moves' "the upgrade did not say that it restarts axisd"
said '^axisd-web: restarting' "the upgrade did not say that it restarts axisd-web"
[ "$(pid_of axisd)" != "$first" ] || die "the old daemon still runs"
[ "$(pid_of axisd-web)" != "$page" ] || die "the old axisd-web still runs"
grep -q 'stopping what moves: feeder' "$root/var/tmp/log" || die "the moving axis was not stopped"
grep -q '^machine: changed' "$root/etc/axisd/axisd.yaml" || die "the upgrade overwrote the configuration"
ready
# That positions outlast a restart is tests/e2e/test_kept_state.py's: this drive was simulated by the daemon that ended.

step "an upgrade that does not take the configurations"
sed -i 's/^machine: .*/machnie: wrong/' "$root/etc/axisd/axisd.yaml"
sed -i 's/^listen: .*/lisetn: wrong/' "$root/etc/axisd/web.yaml"
second=$(pid_of axisd) page=$(pid_of axisd-web)
upgrade
said 'does not take /etc/axisd/axisd.yaml. The old one goes on running' "nothing was said of the configuration"
said 'does not take /etc/axisd/web.yaml. The old one goes on running' "nothing was said of web.yaml"
[ "$(pid_of axisd)" = "$second" ] && running || die "the daemon was restarted all the same"
[ "$(pid_of axisd-web)" = "$page" ] && running axisd-web || die "axisd-web was restarted all the same"
sed -i 's/^machnie: .*/machine: right/' "$root/etc/axisd/axisd.yaml"
sed -i 's/^lisetn: .*/listen: localhost:7480/' "$root/etc/axisd/web.yaml"

step "an upgrade of what does not run"
service stop
service stop axisd-web
upgrade
! running && ! running axisd-web || die "it was not stopped"
[ "$(pid_of axisd)" = "$second" ] && [ "$(pid_of axisd-web)" = "$page" ] || die "an upgrade started it"
service start
service start axisd-web
ready

step "a lost disk, and its backup"
as service-1
ctl state backup /var/tmp/state.backup
service stop
rm -rf "$root"/var/lib/axisd/*
inside chown axisd /var/tmp/state.backup
inside runuser -u axisd -- axisd --restore-state /var/tmp/state.backup >"$scratch/log" || die "it was not restored"
said 'axisctl state accept' "nothing was said of what comes next"
service start
eventually ctl list
as shift-a
refused=$(ctl move feeder 10mm 2>&1) && die "the axis moves before somebody has accepted the state"
grep -q 'axisctl state accept' <<<"$refused" || die "that says not what to do: $refused"
as service-1
ctl state accept
ctl release-stop --all
as shift-a
refused=$(ctl enable feeder 2>&1) && die "what may have been executed before was executed again"
grep -q 'ask again in [0-9]* s' <<<"$refused" || die "that says not until when: $refused"
ctl stop feeder --wait || die "stops have to wait, too"

step "removing, and installing again"
inside dpkg -r axisd axisd-web python3-axisd >"$scratch/log" 2>&1 || { cat "$scratch/log"; die "dpkg -r failed"; }
! running && ! running axisd-web || die "it still runs"
[ -d "$root/var/lib/axisd" ] && [ -f "$root/etc/axisd/axisd.yaml" ] && [ -f "$root/etc/axisd/web.yaml" ] ||
  die "removing took configuration or state"
inside dpkg -i /packages/later-axisd.deb /packages/later-axisd-web.deb >"$scratch/log" 2>&1 ||
  { cat "$scratch/log"; die "dpkg -i failed"; }
eventually ctl list
running && running axisd-web || die "it was not started"

step "purging"
inside dpkg -P axisd axisctl axisd-web python3-axisd >"$scratch/log" 2>&1 || { cat "$scratch/log"; die "dpkg -P failed"; }
! running && ! running axisd-web || die "it still runs"
rm -f "$root"/run/axisd.pid "$root"/run/axisd-web.pid
! inside getent passwd axisd >/dev/null || die "the user is left"
# What others have put there is theirs.
rm -r "$root/etc/axisd/tls"
rmdir "$root/etc/axisd"
snapshot >"$scratch/after"
diff "$scratch/before" "$scratch/after" || die "purging left something (>), or took something (<)"
echo "packages: ok"
