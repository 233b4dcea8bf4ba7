# SPDX-License-Identifier: MIT
# tools/paper repeats the paper's experiment on simulated cycles: its tables have every model next to the paper's numbers, its figures are
# drawings. The full form has four weights instead of one.
. "$(dirname "$0")/../system/lib.sh"
"$PRISM_SOURCE/tools/paper" --short --bin "$PRISM_BIN" "$dir/paper" >"$dir/out" 2>"$dir/paper.err" || fail "tools/paper: $(tail -3 "$dir/paper.err")"
cat "$dir/out"
same "models" "$(ls "$dir/paper/models" | wc -l)" 13
same "rows of tables 4 and 5" "$(grep -c '|.*[0-9]$' "$dir/out")" 8
# Table 1: the signs of the paper. Tables 4 and 5: all inputs leave less than T alone, as in the paper.
awk '/this gyro/ {exit !($3 > 0.3 && $4 < -0.2 && $5 < -0.3)}' "$dir/out" || fail "correlations: $(grep 'this gyro' "$dir/out")"
after() { awk -v inputs="$1" '$1 == inputs && $2 == "huber" {print $6}' "$dir/out"; }
awk -v all="$(after T,dTdt,U)" -v one="$(after T)" 'BEGIN {exit !(all > 0.006 && all < one)}' || fail "found $(after T,dTdt,U) deg/h with all inputs, $(after T) with T"
same "figures" "$(ls "$dir/paper/figures" | sed 's/figure\([0-9]*\)-.*/\1/' | sort -nu | paste -sd' ')" "6 7 8 9 10 11"
for drawing in "$dir"/paper/figures/*.svg; do python3 -c 'import sys, xml.etree.ElementTree as x; x.parse(sys.argv[1])' "$drawing" || fail "$drawing is not XML"; done
code=0; "$PRISM_SOURCE/tools/paper" --bin "$PRISM_BIN" "$dir/paper" one.pcap 2>"$dir/one.err" || code=$?
same "exit code for one recording ($(cat "$dir/one.err"))" "$code" 1
