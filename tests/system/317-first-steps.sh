# SPDX-License-Identifier: MIT
# The commands of README.md ("First steps") run as they are written, in a new directory.
. "$(dirname "$0")/lib.sh"

# block DOCUMENT HEADING NUMBER: the nth sh block after the heading
block() {
  awk -v heading="$2" -v wanted="$3" '/^#/ {under = index($0, heading) > 0} /^```sh/ && under {inside = ++n == wanted; next} /^```/ {inside = 0} inside' "$PRISM_SOURCE/$1"
}

mkdir "$dir/first"; cd "$dir/first"
block README.md "First steps" 2 | grep -v '^ *#' >steps.sh
[ -s steps.sh ] || fail "README.md has no second block under First steps"
bash -e steps.sh >steps.out 2>steps.err || fail "README.md, First steps: $(tail -3 steps.err)"
contains "train begins with its conclusion" "$(head -1 steps.out)" "ready: explains "
contains "and names the next step" "$(head -1 steps.out)" "data quality: pass; next: prismcal evaluate model.json ANOTHER-RECORDING --config gyro1.json --out report"
gain=$(jq -r '.tables.r1_stability.rows[1][5].text' report/report.json)
awk -v gain="$gain" 'BEGIN {exit !(gain > 40)}' || fail "README.md, First steps: improvement $gain %"
block README.md "First steps" 3 | sed -n "/^echo/,/live.json$/p" >config.sh
bash -e config.sh
contains "the live configuration" "$(prismd --check live.json)" "live.json: good"
