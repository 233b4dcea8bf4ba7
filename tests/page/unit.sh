#!/usr/bin/env bash
# SPDX-License-Identifier: MIT
# Tests the computations of the page with node's test runner.
set -euo pipefail
command -v node >/dev/null || { echo "skipped: no node; tools/setup page installs it"; exit 77; }
major=$(node --version | sed 's/^v\([0-9]*\).*/\1/')
[ "$major" -ge 18 ] || { echo "skipped: node $(node --version) has no test runner; expected 18 or later"; exit 77; }
cd "$(dirname "$0")"
exec node --test *.test.mjs
