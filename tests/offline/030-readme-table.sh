# SPDX-License-Identifier: MIT
# The table in README.md is what tools/demo prints: same seeds, same commands, same digits.
. "$(dirname "$0")/../system/lib.sh"
"$PRISM_SOURCE/tools/demo" --table "$dir/demo" >"$dir/out" 2>&1 || { cat "$dir/out"; fail "tools/demo --table: exit code $?"; }
cat "$dir/out"
expected=$(awk '/^  trained on cycle 1/ {
    if (!n++) line = sprintf("| %.5f deg/h |", $(NF - 3))
    last = sprintf("**%.5f deg/h (%.0f %% less)** |", $(NF - 2), $(NF - 1))
    if (n > 1) line = line sprintf(" %.5f |", before)
    before = $(NF - 2)
  } END {print line, last}' "$dir/out")
grep -qF "$expected" "$PRISM_SOURCE/README.md" || fail "README.md: found no line \"$expected\" in its table, expected what tools/demo prints"
range=$(sed -n 's/^Of further cycles 95 % are expected to improve by: \(.*\) % (.*/\1/p' "$dir/out")
[ -n "$range" ] || fail "tools/demo printed no range of the improvement of further cycles"
grep -qF "95 % of further such cycles are expected to improve by $range %" "$PRISM_SOURCE/README.md" ||
  fail "README.md: found not the range \"$range %\" of further cycles, expected what tools/demo prints"
