# SPDX-License-Identifier: MIT
# tools/fleet from the command line: simulated gyros, fake servers, and a backlog.
. "$(dirname "$0")/lib.sh"
. "$PRISM_SOURCE/tests/system/servers.sh"
ls -d /usr/lib/postgresql/*/bin >/dev/null 2>&1 || skip "PostgreSQL is not installed (run tools/setup all)"
fleet() { TMPDIR=$dir "$PRISM_SOURCE/tools/fleet" "$@" --build "$PRISM_BIN"; }
[ "$(id -u)" -ne 0 ] || chmod 711 "$dir"
code=0; fleet none 2>/dev/null >"$dir/usage" || code=$?
same "exit code for an invalid number" "$code" 64
contains "usage" "$(cat "$dir/usage")" "tools/fleet N"
fleet 2 --seconds 4 >"$dir/two" 2>&1 || fail "$(cat "$dir/two")"
contains "two gyros" "$(cat "$dir/two")" "2 simulated gyros at 200 frames/s, a prismd each"
rows=$(sed -n 's/^2 gyros, [0-9]* s: \([0-9]*\) rows.*/\1/p' "$dir/two")
[ "${rows:-0}" -ge 1 ] || fail "found $rows rows of two gyros: $(cat "$dir/two")"
fleet 3 --stand-ins --backlog 3000 >"$dir/three" 2>&1 || fail "$(cat "$dir/three")"
contains "the backlog" "$(cat "$dir/three")" "of the same rows"
same "directories left" "$(ls -d "$dir"/prism-fleet.* 2>/dev/null | wc -l)" 0
