#!/bin/bash
# Builds the page of axisd-web, by npm and its lock file (api/web/README.md). Without a network where npm has been here before.
#   deploy/page.sh DIRECTORY
set -euo pipefail
cd "$(dirname "$(readlink -f "$0")")/.."

die() { echo "page.sh: $*" >&2; exit 1; }
[ $# -eq 1 ] || die "usage: deploy/page.sh DIRECTORY"
target=$(readlink -m "$1")
# Elsewhere protoc and npm have to be there.
if (. /etc/os-release 2>/dev/null && [ "${ID:-}" = debian ] && [ "${VERSION_ID:-}" = 12 ]); then
  deploy/install-packages.sh page
fi
for program in npm protoc; do command -v "$program" >/dev/null || die "$program is missing"; done
cd api/web
[ node_modules/.package-lock.json -nt package-lock.json ] ||
  npm ci --ignore-scripts --no-audit --no-fund --loglevel=error || die "npm could not fetch what package-lock.json names"
npm run --silent build -- "$target" || die "the page was not built"
