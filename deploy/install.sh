#!/bin/bash
# Builds axisd and installs it on this computer as a systemd service, where it is not Debian with deploy/package.sh's
# packages: daemon, axisctl, axisd-sim, axisd-link, axisd-web and its page, axisd-cell, manual pages, completion,
# documentation, the Python client. Starts nothing and restarts nothing: a running axisd keeps its axes until the
# administrator restarts it.
#   sudo deploy/install.sh                 into /usr
#   sudo deploy/install.sh --uninstall     removes what it installed; configuration and state stay
#   DESTDIR=DIR deploy/install.sh          into DIR/usr, for packaging: users and services are left alone
#   BUILD=DIR ... deploy/install.sh        takes what was built there (target installation), and builds nothing
set -euo pipefail
build=${BUILD:+$(readlink -f "$BUILD")}
cd "$(dirname "$(readlink -f "$0")")/.."

die() { echo "install.sh: $*" >&2; exit 1; }
case "${1:-}" in
  '' | --uninstall) ;;
  *) die "usage: deploy/install.sh [--uninstall]" ;;
esac
staged=${DESTDIR:-}
[ -n "$staged" ] || [ "$(id -u)" -eq 0 ] || die "run this as root (or set DESTDIR)"
list=$staged/usr/share/axisd/installed  # every file that was installed, one per line, without DESTDIR
under_systemd() { [ -z "$staged" ] && [ -d /run/systemd/system ]; }

uninstall() {
  [ -f "$list" ] || die "$list is not there: nothing was installed by this script"
  if under_systemd; then
    local unit
    for unit in axisd-cell.service axisd-web.service axisd.service axisd-link.socket axisd-link.service \
        axisd-etcd-backup.timer axisd-etcd.service; do  # the end of axisd stops the axes
      systemctl disable --now "$unit" 2>/dev/null || true
    done
  fi
  local -A folders=()
  local file folder
  while read -r file; do
    rm -f "$staged$file"
    folder=$(dirname "$file")
    # Only folders that hold nothing of others can be empty; nobody misses them.
    while [[ $folder == */axisd* ]]; do folders[$folder]=1; folder=$(dirname "$folder"); done
  done <"$list"
  rm -f "$list"
  printf '%s\n' "${!folders[@]}" | sort -r | while read -r folder; do
    rm -rf "$staged$folder/__pycache__"
    rmdir "$staged$folder" 2>/dev/null || true
  done
  if under_systemd; then
    systemctl daemon-reload
    journalctl --update-catalog || true
  fi
  [ -n "$staged" ] ||
    echo "Left: /etc/axisd, what begins with axisd in /var/lib and /var/lib/private, and the user axisd (userdel axisd)."
}

if [ "${1:-}" = --uninstall ]; then
  uninstall
  exit 0
fi

packaged=$(dpkg-query -W -f '${db:Status-Status} ${Package}\n' axisd axisctl axisd-web axisd-cell python3-axisd axisd-doc 2>/dev/null |
  sed -n 's/^installed //p' | xargs) || true
[ -n "$staged" ] || [ -z "$packaged" ] ||
  die "packages of axisd are installed: remove them first (apt remove $packaged), or make newer ones (deploy/package.sh)"
if (. /etc/os-release 2>/dev/null && [ "${ID:-}" = debian ] && [ "${VERSION_ID:-}" = 12 ]); then
  [ -n "$build" ] || deploy/install-packages.sh build
  deploy/install-packages.sh run
else
  echo "install.sh: not Debian 12: deploy/install-packages.sh names what has to be here, as Debian calls it" >&2
fi
if [ -z "$build" ]; then
  cmake --preset release
  cmake --build --preset release --target installation
  deploy/page.sh build/web
  build=build/release
fi
installed=$build/install_manifest.txt
rm -f "$installed"
cmake --install "$build" --prefix /usr --strip

# The Python client goes where the system's interpreter looks for what its distribution installs.
scheme=$(/usr/bin/python3 -c 'import sysconfig; print("deb_system" if "deb_system" in sysconfig.get_scheme_names() else sysconfig.get_default_scheme())')
modules=$(/usr/bin/python3 -c 'import sys, sysconfig; print(sysconfig.get_path("purelib", sys.argv[1], {"base": "/usr"}))' "$scheme")
stubs=$(mktemp -d)
trap 'rm -rf "$stubs"' EXIT
cp -r api/python/axisd "$stubs"
/usr/bin/python3 -B api/python/generate.py "$stubs"
(cd "$stubs" && find axisd -type f -not -path '*/__pycache__/*' -printf '%P\n') | while read -r file; do
  install -D -m 0644 "$stubs/axisd/$file" "$staged$modules/axisd/$file"
  printf '\n%s' "$modules/axisd/$file" >>"$installed"
done
# What an earlier version had and this one has not is removed.
if [ -f "$list" ]; then
  { grep -vxF -f "$installed" "$list" || true; } | while read -r file; do rm -f "$staged$file"; done
fi
grep . "$installed" >"$list"
[ -z "$staged" ] || exit 0

systemd-sysusers /usr/lib/sysusers.d/axisd.conf
install -d -m 0755 /etc/axisd
systemd-tmpfiles --create /usr/lib/tmpfiles.d/axisd.conf
for file in axisd.yaml links web.yaml cell/cell.yaml; do
  [ -e "/etc/axisd/${file#cell/}" ] || install -m 0644 "deploy/$file" "/etc/axisd/${file#cell/}"
done
if command -v udevadm >/dev/null; then
  udevadm control --reload
  udevadm trigger --subsystem-match=tty --subsystem-match=usb-serial
fi
if [ -d /run/systemd/system ]; then systemctl daemon-reload; fi
if command -v journalctl >/dev/null; then journalctl --update-catalog || true; fi

echo
echo "1. /etc/axisd/axisd.yaml describes a simulated axis, and says how to go on with a machine"
echo "2. axisctl check /etc/axisd/axisd.yaml"
echo "3. For CAN: deploy/README.md, section CAN links"
echo "4. systemctl enable axisd && systemctl restart axisd    (a restart stops the axes of a running daemon)"
