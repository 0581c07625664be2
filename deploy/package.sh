#!/bin/bash
# Makes the Debian packages of the last commit: axisd, axisctl, axisd-web, axisd-cell, python3-axisd, axisd-doc, and -dbgsym of
# the first four.
#   deploy/package.sh [DIRECTORY]      default: build/package
# The same commit gives the same bytes, wherever it is built. A commit with the tag vVERSION is that version, one before
# it VERSION~gitTIME.COMMIT, one after it VERSION+gitTIME.COMMIT, so that later commits upgrade earlier ones. JOBS=N builds
# with N jobs; LINTIAN=no leaves lintian out.
set -euo pipefail

die() { echo "package.sh: $*" >&2; exit 1; }
[ $# -le 1 ] || die "usage: deploy/package.sh [DIRECTORY]"
clone=$(readlink -f "$(dirname "$(readlink -f "$0")")/..")
out=$(readlink -m "${1:-$clone/build/package}")
mkdir -p "$out"
cd "$clone"

deploy/install-packages.sh build
deploy/install-packages.sh package
git rev-parse --quiet --verify HEAD >/dev/null || die "this is no clone: packages are made of commits"
[ -z "$(git status --porcelain)" ] || echo "package.sh: what is not committed is left out" >&2

version=$(sed -n 's/^project(axisd VERSION \([0-9.]*\).*/\1/p' CMakeLists.txt)
changelog=$(dpkg-parsechangelog --file deploy/debian/changelog --show-field Version)
[ "$version" = "$changelog" ] || die "CMakeLists.txt says $version, deploy/debian/changelog $changelog"
commit=$(git rev-parse HEAD)
snapshot=git$(TZ=UTC git log -1 --date=format-local:%Y%m%d%H%M%S --format=%cd).${commit:0:8}
if [ "$(git describe --exact-match --tags --match "v$version" 2>/dev/null)" = "v$version" ]; then
  full=$version
elif git merge-base --is-ancestor "v$version" HEAD 2>/dev/null; then
  full=$version+$snapshot
else
  full=$version~$snapshot
fi

# Always at the same place: precompiled headers name the place where they were made, and ccache finds what was compiled
# with them there. Of one user only one build at a time.
tree=${TMPDIR:-/tmp}/axisd-package.$UID
mkdir -m 0700 "$tree" 2>/dev/null || [ -d "$tree" ] || die "cannot make $tree"
if [ ! -O "$tree" ] || [ -L "$tree" ]; then die "$tree is somebody else's"; fi
exec 9<"$tree"
flock --nonblock 9 || die "another build of packages is under way in $tree"
trap 'rm -rf "$tree"' EXIT
umask 022
find "$tree" -mindepth 1 -delete  # of a build that was killed
mkdir "$tree/axisd"
git archive HEAD | tar -x -C "$tree/axisd"
cd "$tree/axisd"
cp -r deploy/debian .
# A build of packages has no network, and npm needs one: the page is built before, and is part of the source that debhelper
# gets. What Node.js compresses depends on its version; what Debian's gzip does not.
deploy/page.sh page
rm -rf api/web/node_modules api/web/generated
find page -name '*.gz' | while read -r file; do gzip -9nc "${file%.gz}" >"$file"; done
# The entry of a version that is not released: made from the commit, as what is in the packages depends on its time.
maintainer=$(dpkg-parsechangelog --show-field Maintainer)
when=$(git -C "$clone" log -1 --format=%cD)
case $full in
  *+*)
    printf 'axisd (%s) bookworm; urgency=medium\n\n  * After the release.\n\n -- %s  %s\n\n' "$full" "$maintainer" "$when" |
      cat - deploy/debian/changelog >debian/changelog
    ;;
  *~*) sed -i "1s/($version)/($full)/; 0,/^ -- /s/^ -- .*/ -- $maintainer  $when/" debian/changelog ;;
esac
# Debian's own programs: another python3 on the PATH would not have their modules. debhelper hides the home directory, and
# with it what ccache has. By depend mode: else ccache takes what differs in its comments only for the same, and debug
# information has the checksums of the sources.
CCACHE_DEPEND=1 CCACHE_DIR=${CCACHE_DIR:-$(ccache --get-config cache_dir)} PATH=/usr/sbin:/usr/bin:/sbin:/bin \
  DEB_BUILD_OPTIONS="parallel=${JOBS:-$(nproc)} ${DEB_BUILD_OPTIONS:-}" LC_ALL=C.UTF-8 \
  dpkg-buildpackage --build=binary --no-sign --root-command=fakeroot >"$out/build.log" 2>&1 ||
  { tail -n 40 "$out/build.log" >&2; die "the build failed; all of it is in $out/build.log"; }
if [ "${LINTIAN:-yes}" = yes ]; then
  as_root=()
  [ "$(id -u)" -ne 0 ] || as_root=(--allow-root)
  lintian "${as_root[@]}" --fail-on=error,warning --tag-display-limit 0 "$tree"/axisd_*.changes
fi
rm -f "$out"/*.deb "$out"/*.buildinfo "$out"/*.changes
mv "$tree"/*.deb "$tree"/*.buildinfo "$tree"/*.changes "$out"
(cd "$out" && sha256sum ./*.deb && du -h --apparent-size ./*.deb)
