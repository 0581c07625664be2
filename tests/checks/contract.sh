#!/bin/bash
# buf lint over proto/, and buf breaking against the last release (proto/baseline.binpb, which proto/release.sh writes).
#   tests/checks/contract.sh
set -euo pipefail
cd "$(dirname "$0")/../.."
buf=$(compgen -G 'node_modules/@bufbuild/buf-linux-*/bin/buf' | head -n 1) ||
  { echo "contract.sh: buf is missing: npm ci --ignore-scripts (tests/run.sh does that)" >&2; exit 1; }
export BUF_CACHE_DIR="${TMPDIR:-/tmp}/axisd-buf.$UID"
cd proto
../"$buf" lint
../"$buf" breaking --against baseline.binpb

# A break must not hide behind a new baseline: that has to hold everything that the one before it held.
git() { command git -c safe.directory='*' "$@"; }
mapfile -t written < <(git log -n 2 --format=%H -- baseline.binpb 2>/dev/null)
before=${written[1]:-}
git diff --quiet HEAD -- baseline.binpb 2>/dev/null || before=${written[0]:-}
[ -n "$before" ] || exit 0
former=$(mktemp "${TMPDIR:-/tmp}/axisd-baseline.XXXXXX.binpb")
trap 'rm -f "$former"' EXIT
git show "$before:./baseline.binpb" >"$former"
../"$buf" breaking baseline.binpb --against "$former"
