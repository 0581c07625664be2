#!/bin/bash
# buf lint over proto/, and buf breaking against the last release, once there is one.
set -euo pipefail
cd "$(dirname "$0")/../.."
buf=$(compgen -G 'node_modules/@bufbuild/buf-linux-*/bin/buf' | head -n 1) ||
  { echo "contract.sh: buf is missing: npm ci --ignore-scripts (tests/run.sh does that)" >&2; exit 1; }
export BUF_CACHE_DIR="${TMPDIR:-/tmp}/axisd-buf.$UID"
(cd proto && "../$buf" lint)

git() { command git -c safe.directory='*' "$@"; }
release=$(git describe --tags --match 'v[0-9]*' --abbrev=0 2>/dev/null || true)
[ -n "$release" ] || exit 0
before=$(mktemp -d "${TMPDIR:-/tmp}/axisd-proto.XXXXXX")
trap 'rm -rf "$before"' EXIT
git archive "$release" proto | tar -x -C "$before"
(cd proto && "../$buf" breaking --against "$before/proto")
