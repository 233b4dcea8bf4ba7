# SPDX-License-Identifier: MIT
# The table in README.md is what tools/demo prints: same seeds, same commands, same digits. The demo then serves its directory
# as a page, together with a gyro in real time, until Ctrl-C, which leaves no process and no file.
. "$(dirname "$0")/../system/lib.sh"
"$PRISM_SOURCE/tools/demo" --table "$dir/demo" >"$dir/out" 2>&1 || { cat "$dir/out"; fail "tools/demo --table: exit code $?"; }
cat "$dir/out"
# A line of the table ends: RAW CORRECTED IMPROVEMENT % LOW to HIGH %
expected=$(awk '/^  trained on cycle 1/ {
    if (!n++) {line = sprintf("| 1 sigma, deg/h | %.5f |", $(NF - 7)); ranges = "| improvement in 95 % of further cycles | |"}
    if (n > 1) {line = line sprintf(" %.5f |", before); ranges = ranges range}
    before = $(NF - 6)
    range = sprintf(" %.0f to %.0f %% |", $(NF - 3), $(NF - 1))
    last = sprintf("**%.5f (%.0f %% less)** |", $(NF - 6), $(NF - 5))
  } END {print line, last; print ranges range}' "$dir/out")
while read -r line; do
  grep -qF "$line" "$PRISM_SOURCE/README.md" || fail "README.md: found no line \"$line\" in its table, expected what tools/demo prints"
done <<<"$expected"

TMPDIR=$dir XDG_RUNTIME_DIR=$dir start serve env --default-signal=INT "$PRISM_SOURCE/tools/demo" --serve "$dir/demo" --listen 127.0.0.1:0
serve=$pid
wait_for 10 grep -q token= serve.out
url=$(sed -n 's|^\(http.*\)#token=.*|\1|p' serve.out)
token=$(cat "$dir/prismweb-$(sed 's|.*:\([0-9]*\)/$|\1|' <<<"$url").token")
contains "the page" "$(curl -s "$url")" '<!DOCTYPE html>'
api() { curl -s -H "Authorization: Bearer $token" "${url}api/$1"; }
both() { [ "$(api instances | jq -c '[.[] | [.name, .state]]')" = '[["run","running"],["live","running"]]' ]; }
wait_for 5 both
live() { [ "$(api live/status | jq .line.frames)" -gt 100 ]; }
wait_for 10 live
code=0
kill -INT "$serve"; wait "$serve" || code=$?
same "exit code of a served demo that was interrupted" "$code" 130
[ -z "$(ls -d "$dir"/prism-page.* 2>/dev/null)" ] || fail "found $(ls -d "$dir"/prism-page.*), expected nothing left of a served demo"
! pgrep -f "$dir/demo/" >/dev/null || fail "found $(pgrep -fa "$dir/demo/"), expected that a served demo ends what it started"
