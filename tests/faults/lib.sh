# SPDX-License-Identifier: MIT
# What the tests of faults share beyond tests/system/lib.sh. Each fault is injected for real. PRISM_ENDURANCE=1 runs the long form:
# long QUICK LONG gives the number that the form takes.
. "$PRISM_SOURCE/tests/system/lib.sh"
PATH=$PRISM_BIN/tools/prismcal:$PATH
long() { [ -n "${PRISM_ENDURANCE:-}" ] && echo "$2" || echo "$1"; }
