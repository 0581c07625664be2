#!/bin/bash
# clang-tidy on changed C++ files; a warning is an error. Needs compile_commands.json of a configured build.
#   tests/checks/tidy.sh BUILD [--all | --since COMMIT]
# Default: what differs from where this branch left origin/main, or on main itself what the last commit and the work
# tree changed. AXISD_TIDY_SECONDS (default 300) bounds the time: beyond it no further file is begun, and the files
# left out are named.
set -euo pipefail
cd "$(dirname "$0")/../.."
build=${1:?"usage: tests/checks/tidy.sh BUILD [--all | --since COMMIT]"}
database=$build/compile_commands.json
[ -f "$database" ] || { echo "tidy.sh: no $database: configure first (cmake --preset dev)" >&2; exit 2; }

git() { command git -c safe.directory='*' "$@"; }
case "${2:-}" in
  --all) since='' ;;
  --since) since=${3:?"--since needs a commit"} ;;
  '')
    since=$(git merge-base HEAD origin/main 2>/dev/null || true)
    if [ -z "$since" ] || [ "$since" = "$(git rev-parse HEAD)" ]; then since=$(git rev-parse -q --verify HEAD~1 || true); fi
    ;;
  *) echo "tidy.sh: unknown option '$2'" >&2; exit 2 ;;
esac
if [ -n "$since" ]; then
  mapfile -t changed < <(git diff --name-only --diff-filter=d "$since" -- '*.cpp')
else
  mapfile -t changed < <(git ls-files '*.cpp')
fi

files=()
for file in "${changed[@]}"; do
  # Files that this build does not compile have no flags to check them with.
  if grep -qF "\"file\": \"$PWD/$file\"" "$database"; then files+=("$file"); fi
done
echo "tidy: ${#files[@]} file(s)${since:+ changed since $(git rev-parse --short "$since")}"
[ "${#files[@]}" -gt 0 ] || exit 0

# The program that xargs runs for each file.
export AXISD_TIDY_BUILD=$build AXISD_TIDY_END=$(($(date +%s) + ${AXISD_TIDY_SECONDS:-300}))
# shellcheck disable=SC2016
printf '%s\0' "${files[@]}" | xargs -0 -P "$(nproc)" -n 1 bash -c '
  if [ "$(date +%s)" -ge "$AXISD_TIDY_END" ]; then echo "tidy: out of time, not checked: $1"; exit 0; fi
  clang-tidy-19 --quiet -p "$AXISD_TIDY_BUILD" "$1" 2>/dev/null || { echo "tidy: $1 has findings"; exit 1; }' tidy
