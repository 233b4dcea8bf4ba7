# SPDX-License-Identifier: MIT
# The table in README.md is what tools/demo prints: same seeds, same commands, same digits.
. "$(dirname "$0")/../system/lib.sh"
"$PRISM_SOURCE/tools/demo" --table "$dir/demo" >"$dir/out" 2>&1 || { cat "$dir/out"; fail "tools/demo --table: exit code $?"; }
cat "$dir/out"
# A line of the table ends: RAW CORRECTED IMPROVEMENT % LOW to HIGH %
expected=$(awk '/^  trained on cycle 1/ {
    if (!n++) {line = sprintf("| 1 sigma, deg/h | %.5f |", $(NF - 7)); ranges = "| 95 % of further cycles, less | |"}
    if (n > 1) {line = line sprintf(" %.5f |", before); ranges = ranges range}
    before = $(NF - 6)
    range = sprintf(" %.0f to %.0f %% |", $(NF - 3), $(NF - 1))
    last = sprintf("**%.5f (%.0f %% less)** |", $(NF - 6), $(NF - 5))
  } END {print line, last; print ranges range}' "$dir/out")
while read -r line; do
  grep -qF "$line" "$PRISM_SOURCE/README.md" || fail "README.md: found no line \"$line\" in its table, expected what tools/demo prints"
done <<<"$expected"
