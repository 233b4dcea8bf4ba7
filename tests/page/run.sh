#!/usr/bin/env bash
# SPDX-License-Identifier: MIT
# Tests the page in Debian's Chromium. Screenshots are in PRISM_BIN/page.
set -euo pipefail
here=$(cd "$(dirname "$0")" && pwd)
skip() { echo "skipped: $1; tools/setup page installs it"; exit 77; }
for program in chromium chromedriver; do command -v $program >/dev/null || skip "no $program"; done
[ -f /usr/share/javascript/dygraphs/dygraph.min.js ] || skip "no libjs-dygraphs"
python=/usr/bin/python3  # Debian's Python finds Debian's modules
for module in selenium aiohttp; do "$python" -c "import $module" 2>/dev/null || skip "no python3-$module"; done
exec "$python" "$here/page_tests.py" "${PRISM_BIN:?set by ctest}/page" "$PRISM_BIN"
