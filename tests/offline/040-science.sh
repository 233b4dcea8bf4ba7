# SPDX-License-Identifier: MIT
# The default model on gyros with hidden causes, one gyro per simulated truth: never worse than no correction, except if there is
# nothing to correct, and with a true standard deviation. docs/benchmarks.md has the same table for six gyros.
. "$(dirname "$0")/../system/lib.sh"
[ -x "$PRISM_BIN/tests/bench/bench_science" ] || skip "bench_science is not built (tools/check --full)"
"$PRISM_BIN/tests/bench/bench_science" simulated 101001 1 >"$dir/table" || fail "exit code $?"
cat "$dir/table"
# | truth | profile | composite (worst) | stepwise 2 | blocked | REML | against the best | within 2 sd_mean, % | …
awk -F' *[|] *' '/^[|] (base|hard|smooth)/ {
    ++rows
    split($4, gain, " ")
    if ($3 != "steady" && gain[1] < 20) print $2, $3 ": found an improvement of " gain[1] " %, expected 20 or more"
    if ($9 < 70) print $2, $3 ": found " $9 " % within 2 sd_mean, expected 70 or more"
    sum += $9
  } END {
    if (rows != 24) print "found " rows " rows, expected 24"
    if (sum / rows < 92 || sum / rows > 99) print "found " sum / rows " % within 2 sd_mean over all rows, expected 92 to 99"
  }' "$dir/table" >"$dir/wrong"
[ ! -s "$dir/wrong" ] || fail "$(cat "$dir/wrong")"
