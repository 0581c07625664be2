#!/bin/bash
# Builds axisd and installs it on this computer as a systemd service. Starts nothing and restarts nothing: a running
# axisd keeps its axes until the administrator restarts it.
#   sudo deploy/install.sh                 into /usr
#   DESTDIR=DIR deploy/install.sh          into DIR/usr, for packaging: users and services are left alone
set -euo pipefail
cd "$(dirname "$(readlink -f "$0")")/.."

die() { echo "install.sh: $*" >&2; exit 1; }
staged=${DESTDIR:-}
[ -n "$staged" ] || [ "$(id -u)" -eq 0 ] || die "run this as root (or set DESTDIR)"

deploy/install-packages.sh build
deploy/install-packages.sh run
cmake --preset release
cmake --build --preset release --target axisd axisctl axisd-sim axisd-link api_reference axisctl_manual
cmake --install build/release --prefix /usr --strip
[ -z "$staged" ] || exit 0

systemd-sysusers /usr/lib/sysusers.d/axisd.conf
install -d -m 0755 /etc/axisd
install -d -m 0755 /usr/share/bash-completion/completions
axisctl completion bash >/usr/share/bash-completion/completions/axisctl
if command -v udevadm >/dev/null; then
  udevadm control --reload
  udevadm trigger --subsystem-match=tty --subsystem-match=usb-serial
fi
if [ -d /run/systemd/system ]; then systemctl daemon-reload; fi

echo
[ -f /etc/axisd/axisd.yaml ] ||
  echo "1. Write /etc/axisd/axisd.yaml; start from /usr/share/doc/axisd/examples/reference.yaml"
echo "2. axisctl check /etc/axisd/axisd.yaml"
echo "3. For CAN: deploy/README.md, section CAN links"
echo "4. systemctl enable axisd && systemctl restart axisd    (a restart stops the axes of a running daemon)"
