#!/bin/bash
# Fails on C++ that clang-format would write otherwise. To repair: tests/checks/format.sh --fix
set -euo pipefail
cd "$(dirname "$0")/../.."
mode=(--dry-run -Werror)
if [ "${1:-}" = --fix ]; then mode=(-i); fi
/usr/bin/python3 -B tests/checks/tree.py . .cpp .hpp | xargs -0 -P 2 -n 40 clang-format-19 "${mode[@]}"
