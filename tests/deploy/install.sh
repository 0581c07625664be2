#!/bin/bash
# deploy/install.sh and its --uninstall: all that it installs works and goes again, and nothing of others goes with it.
#   tests/deploy/install.sh BUILD            into a folder; BUILD has all that its target installation builds
#   tests/deploy/install.sh BUILD --whole    as on a computer, on top of this one's file system, which stays as it is; as
#                                            root, by hand
set -euo pipefail
build=$(readlink -f "${1:?"usage: tests/deploy/install.sh BUILD [--whole]"}")
cd "$(dirname "$(readlink -f "$0")")/../.."
if [ "${2:-}" = --whole ] && [ -z "${AXISD_INSIDE:-}" ]; then
  AXISD_INSIDE=1 exec unshare --mount --propagation private "$PWD/tests/deploy/install.sh" "$build" --whole
fi

die() { echo "install.sh: $*" >&2; exit 1; }
scratch=$(mktemp -d "${TMPDIR:-/tmp}/axisd-install.XXXXXX")
clean_up() {
  for mounted in root layer; do ! mountpoint -q "$scratch/$mounted" || umount --recursive --lazy "$scratch/$mounted"; done
  rm -rf --one-file-system "$scratch"
}
trap clean_up EXIT
quietly() { "$@" >"$scratch/log" 2>&1 || { cat "$scratch/log" >&2; die "failed: $*"; }; }

# What is installed out of the build is what its target builds.
ninja -C "$build" -t commands installation >"$scratch/commands"
grep -o "\"$build/[^\"]*\"" "$build/cmake_install.cmake" | tr -d '"' | sed "s#^$build/##" | grep -v "/cmake_install.cmake\$\|MANIFEST" >"$scratch/taken"
while read -r file; do
  name=${file##*/}
  grep -qE "[ />]${name//./\\.}([ \"]|$)" "$scratch/commands" || die "the target installation does not build $file"
done <"$scratch/taken"

works() {  # FOLDER PREFIX [COMMAND ...]: what lies in FOLDER, as it is called: with PREFIX, by COMMAND
  local folder=$1 prefix=$2 program unit
  shift 2
  for program in axisd axisctl axisd-sim axisd-web axisd-cell; do quietly "$@" "$prefix/usr/bin/$program" --help; done
  quietly "$@" "$prefix/usr/bin/axisd" --check --config deploy/axisd.yaml
  for unit in axisd axisd-web axisd-cell axisd-link axisd-etcd axisd-etcd-backup; do
    [ -f "$folder/usr/lib/systemd/system/$unit.service" ] || die "there is no $unit.service"
  done
  grep -h '^Exec' "$folder"/usr/lib/systemd/system/axisd*.service | grep -o '/usr/[a-z/]*axisd[a-z/.-]*' >"$scratch/run"
  while read -r program; do
    [ -x "$folder$program" ] || die "a unit runs $program, which is not installed"
  done <"$scratch/run"
}

in_a_folder() {
  local stage=$scratch/stage
  install_there() { quietly env DESTDIR="$stage" BUILD="$build" deploy/install.sh "$@"; }
  files() { (cd "$stage" && find . -type f -o -type l) | sort; }
  mkdir -p "$stage"/usr/{bin,share/axisd,share/axisd-other} "$stage/etc/axisd" "$stage/var/lib/axisd"
  touch "$stage"/{usr/bin/of-others,usr/share/axisd/of-others,usr/share/axisd-other/file,etc/axisd/axisd.yaml,var/lib/axisd/state.v1}
  files >"$scratch/before"

  install_there
  works "$stage" "$stage"
  local list=/usr/share/axisd/installed
  { cat "$scratch/before"; sed 's/^/./' "$stage$list"; echo ".$list"; } | sort >"$scratch/expected"
  files | diff "$scratch/expected" - || die "$list does not list what was installed (>), or lists what was not (<)"
  PYTHONPATH=$(dirname "$(dirname "$(find "$stage" -path '*/axisd/__init__.py')")") /usr/bin/python3 -B -c \
    'import sys, axisd; assert axisd.__file__.startswith(sys.argv[1]), axisd.__file__' "$stage" ||
    die "the Python client does not work"

  # A later version has not all that an earlier one had.
  echo /usr/share/axisd/of-an-earlier-version >>"$stage$list"
  touch "$stage/usr/share/axisd/of-an-earlier-version"
  install_there
  files | diff "$scratch/expected" - || die "an upgrade left something (>), or took something (<)"

  install_there --uninstall
  files | diff "$scratch/before" - || die "it left something (>), or took something (<)"
  ! find "$stage" -mindepth 1 -type d -name 'axisd*' -empty | grep . || die "it left these folders"
  ! DESTDIR=$stage deploy/install.sh --uninstall >"$scratch/log" 2>&1 || die "it uninstalled what is not there"
  grep -q 'nothing was installed' "$scratch/log" || die "that says not what is wrong: $(cat "$scratch/log")"
}

# In namespaces of its own: every change lies in $scratch/layer/changed.
on_this_computer() {
  [ "$(id -u)" -eq 0 ] || die "run this as root: it installs"
  local root=$scratch/root changes=$scratch/layer/changed
  mkdir "$root" "$scratch/layer"
  mount -t tmpfs none "$scratch/layer"
  mkdir "$changes" "$scratch/layer/work"
  mount -t overlay overlay -o "lowerdir=/,upperdir=$changes,workdir=$scratch/layer/work" "$root"
  mount --rbind /proc "$root/proc"
  mount --rbind /dev "$root/dev"
  mount -t tmpfs none "$root/run"
  mount -t tmpfs none "$root/tmp"
  mkdir -p "$root$PWD" "$root$build"
  mount --bind "$PWD" "$root$PWD"
  mount --bind "$build" "$root$build"
  inside() { chroot "$root" env -C "$PWD" -u DESTDIR "$@"; }
  changed() { (cd "$changes" && find . -mindepth 1 ! -type d) | sort; }
  ! inside getent passwd axisd >/dev/null || die "this computer has a user axisd"

  quietly inside env BUILD="$build" deploy/install.sh
  works "$root" '' inside
  inside getent passwd axisd >/dev/null || die "there is no user axisd"
  [ "$(inside stat -c '%U:%G %a' /var/lib/axisd)" = "axisd:axisd 750" ] || die "/var/lib/axisd is not the daemon's"
  inside /usr/bin/python3 -B -c 'import axisd' || die "the Python client does not work"
  for file in axisd.yaml links web.yaml cell.yaml; do [ -f "$root/etc/axisd/$file" ] || die "there is no /etc/axisd/$file"; done
  echo '# changed' >>"$root/etc/axisd/axisd.yaml"
  quietly inside env BUILD="$build" deploy/install.sh
  grep -q '^# changed' "$root/etc/axisd/axisd.yaml" || die "it overwrote the configuration"
  quietly inside deploy/install.sh --uninstall
  # Configuration, the user, and what systemd makes of catalogs.
  changed | grep -vE '^\./etc/(axisd/(axisd|web|cell)\.yaml|axisd/links|(passwd|group|shadow|gshadow)-?|\.pwd\.lock|subuid-?|subgid-?)$|^\./var/lib/systemd/catalog/database$' |
    tee "$scratch/left" || true
  [ ! -s "$scratch/left" ] || die "that is left, or was taken"
  grep -q '^# changed' "$root/etc/axisd/axisd.yaml" || die "it took the configuration"
}

case "${2:-}" in
  '') in_a_folder ;;
  --whole) on_this_computer ;;
  *) die "unknown: $2" ;;
esac
echo "install: ok"
