#!/bin/bash
# Runs shellcheck on every shell script of the tree, also those without a suffix.
set -euo pipefail
cd "$(dirname "$0")/../.."
mapfile -d '' files < <(/usr/bin/python3 -B tests/checks/tree.py . .sh)
shellcheck --severity=warning "${files[@]}" .ci/run deploy/debian/*.{preinst,postinst,prerm,postrm}
