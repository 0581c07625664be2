#!/bin/bash
# Installs what axisd needs on Debian 12. Quick, and without a network, when everything is there.
#   deploy/install-packages.sh [build|run|test|page|package|all]      (default: all)
# build: compiler and libraries; run: what built programs need; test: what tests/run.sh needs beside build;
# page: what the page of axisd-web is built with; package: what deploy/package.sh and its test need beside build;
# all: everything but package.
# Run as root, or as a user who may use sudo.
set -euo pipefail

build=(
  ca-certificates ccache clang-19 cmake git libbenchmark-dev libboost1.81-dev libcli11-dev libfmt-dev libgmock-dev
  libgrpc++-dev libgrpc-dev libgtest-dev libmodbus-dev libnghttp2-dev libprotobuf-dev libsodium-dev libspdlog-dev libssl-dev libsystemd-dev
  libyaml-cpp-dev lld-19 llvm-19 ninja-build pkg-config protobuf-compiler protobuf-compiler-grpc
  python3 python3-protobuf
)
run=(libabsl20220623 libatomic1 libfmt9 libgrpc++1.51 libmodbus5 libnghttp2-14 libprotobuf32 libsodium23 libspdlog1.10 libsystemd0 libyaml-cpp0.7)
# prometheus starts a server of its own where there is an init: systemctl disable --now prometheus. So does etcd-server, an
# open one: its unit is masked below, and nothing else of it is started either.
test=(
  can-utils chromium clang-format-19 clang-tidy-19 e2fsprogs etcd-client etcd-server fish fonts-wqy-microhei groff-base iproute2 libclang-rt-19-dev mypy openssl procps prometheus python3-can
  python3-grpcio python3-jsonschema python3-pymodbus python3-serial python3-serial-asyncio
  python3-setuptools python3-venv python3-wheel python3-yaml shellcheck systemd user-mode-linux xvfb zsh
)
package=(
  debhelper dh-python dpkg-dev fakeroot iproute2 lintian mmdebstrap pybuild-plugin-pyproject python3-all python3-setuptools
)

die() { echo "install-packages.sh: $*" >&2; exit 1; }

. /etc/os-release 2>/dev/null || die "cannot read /etc/os-release: is this Debian 12?"
[ "${ID:-}" = debian ] && [ "${VERSION_ID:-}" = 12 ] ||
  die "this is ${PRETTY_NAME:-an unknown system}; axisd's packages are named for Debian 12 (bookworm)"

case "${1:-all}" in
  build) wanted=("${build[@]}") ;;
  run) wanted=("${run[@]}") ;;
  package) wanted=("${package[@]}") ;;
  page) wanted=(ca-certificates protobuf-compiler) ;;
  test | all) wanted=("${build[@]}" "${run[@]}" "${test[@]}") ;;
  *) die "unknown set '$1': use build, run, test, page, package or all" ;;
esac

# One query for all: names that dpkg does not know appear only on its standard error and are missing, too.
installed=$(dpkg-query -W -f '${db:Status-Status} ${Package}\n' "${wanted[@]}" 2>/dev/null | sed -n 's/^installed //p') ||
  true
mapfile -t missing < <(printf '%s\n' "${wanted[@]}" | grep -vxF -f <(printf '%s\n' "$installed") || true)

# npm fetches buf, the libraries of the page and of the Node.js example, and the CANopen library of tests/foreign. Debian's npm conflicts with
# Node.js from elsewhere, so any npm will do.
case "${1:-all}" in test | all | page) command -v npm >/dev/null || missing+=(nodejs npm) ;; esac

[ "${#missing[@]}" -gt 0 ] || exit 0

as_root=()
if [ "$(id -u)" -ne 0 ]; then
  command -v sudo >/dev/null || die "missing: ${missing[*]}; run this as root (there is no sudo)"
  as_root=(sudo)
fi
echo "installing: ${missing[*]}"
"${as_root[@]}" apt-get update -qq || die "apt-get update failed: check the network and /etc/apt/sources.list"

# A unit that is masked before it is there is not started; where the init is another one, policy-rc.d says so.
policy=/usr/sbin/policy-rc.d
if [[ " ${missing[*]} " == *" etcd-server "* ]]; then
  "${as_root[@]}" mkdir -p /etc/systemd/system
  "${as_root[@]}" ln -sfn /dev/null /etc/systemd/system/etcd.service
  if [ ! -e "$policy" ]; then
    trap '"${as_root[@]}" rm -f "$policy"' EXIT
    printf '#!/bin/sh\nexit 101\n' | "${as_root[@]}" tee "$policy" >/dev/null
    "${as_root[@]}" chmod 755 "$policy"
  fi
fi
"${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends "${missing[@]}" \
  >/dev/null || die "apt-get install failed; missing: ${missing[*]}"
