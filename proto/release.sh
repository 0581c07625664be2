#!/bin/bash
# Makes the present proto/ the contract that later ones must not break: writes proto/baseline.binpb, the image that
# tests/checks/contract.sh compares with. Part of a release, together with its tag; nothing else writes that file.
set -euo pipefail
cd "$(dirname "$(readlink -f "$0")")/.."
[ -z "$(git status --porcelain -- proto)" ] ||
  { echo "release.sh: proto/ has changes that are not committed: what clients were promised must be in the history" >&2; exit 1; }
tests/checks/contract.sh
buf=$(compgen -G 'node_modules/@bufbuild/buf-linux-*/bin/buf' | head -n 1)
"$buf" build proto --exclude-source-info -o proto/baseline.binpb
git --no-pager diff --stat -- proto/baseline.binpb
echo "release.sh: commit proto/baseline.binpb with the version, then tag that commit"
