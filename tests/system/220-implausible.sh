# SPDX-License-Identifier: MIT
# A temperature of −273 or 1000 degC, a jump of 20 degC, a constant temperature, and a rate of 3.4e38 deg/h are never `good`, do not
# affect the bias, are reported once each, and are ignored by tools that read the log. In the field such faults gave `good` and a
# bias of −9.75 deg/h.
. "$(dirname "$0")/lib.sh"
# One sample per second: 8 deg/h, and 25 degC that alternates by 0.001 degC, except for the faults.
seq 1 1500 | awk 'BEGIN { print "t,rate,temperature,uhfo" } {
    rate = 8; temperature = 25 + 0.001 * ($1 % 2)
    if ($1 > 200 && $1 <= 210) temperature = -273
    if ($1 > 400 && $1 <= 403) temperature = 1000
    if ($1 > 600 && $1 <= 606) temperature = 45
    if ($1 > 800 && $1 <= 802) rate = 3.4e38
    if ($1 > 1000 && $1 <= 1200) temperature = 25
    print 1700000000 + $1 "," rate "," temperature ",5" }' >"$dir/faults.csv"
prismcal convert "$dir/faults.csv" --map rate=rate:deg/h,temperature=temperature:degC,uhfo=uhfo:V,time=t:s --out "$dir/faults.pcap" >"$dir/convert.out"
config_file() {
  echo "{\"name\": \"gyro\", \"line\": {\"device\": \"/dev/null\"}, \"frames\": \"$PRISM_SOURCE/config/frames/second-means.json\", \"model\": \"$PRISM_SOURCE/tests/replay/frames/models/T.json\",
        \"clock\": \"device\", \"plausibility\": {\"temperature\": {\"stuck_s\": 100}}$1}" >"$dir/gyro.json"
}
config_file ""
prismd --check "$dir/gyro.json" >"$dir/check.out" 2>&1 || fail "$(cat "$dir/check.out")"
prismd "$dir/gyro.json" --replay "$dir/faults.pcap" --out "$dir/log" >"$dir/summary" 2>"$dir/prismd.err"
# column NAME FROM TO: prints this column of the rows of these seconds.
column() { grep -hv '^#' "$dir"/log/*.csv | awk -F, -v name="$1" -v from=$((1700000000 + $2)) -v to=$((1700000000 + $3)) '
  NR == 1 { for (i = 1; i <= NF; ++i) c[$i] = i } NR > 1 && $c["time_s"] > from && $c["time_s"] <= to { print $c[name] }'; }
# each WHAT FROM TO PATTERN: the quality of each of these seconds must match the pattern.
each() {
  [ "$(column quality "$2" "$3" | wc -l)" = $(($3 - $2)) ] || fail "$1: found $(column quality "$2" "$3" | wc -l) rows, expected $(($3 - $2))"
  ! column quality "$2" "$3" | grep -qvE "$4" || fail "$1: found $(column quality "$2" "$3" | sort | uniq -c), expected each with $4"
}
each "before" 50 200 '^good$'
each "-273 degC" 200 210 'implausible'
each "1000 degC" 400 403 'implausible'
each "a jump of 20 degC" 600 606 'implausible'
each "a rate of 3.4e38" 800 802 '^implausible$'
each "stuck for less than 100 s" 1000 1090 '^good$'
each "stuck" 1102 1200 'implausible'
each "plausible again" 1220 1500 '^good$'
same "measured temperatures in the log" "$(column temperature_degc 200 202 | sort -u) $(column temperature_degc 400 402 | sort -u)" "-273.00000 1000.00000"
same "corrected rates of an impossible rate" "$(column corrected_deg_per_h 800 802 | sort -u)" ""
contains "an impossible rate" "$(column rate_deg_per_h 800 801)" "3.4e+38"
# bias = −0.5 + 0.01 T − 1.5 dT/dt
wrong=$(column bias_deg_per_h 10 1500 | awk '$1 != "" && ($1 < -0.2505 || $1 > -0.2495)' | sort -u)
same "biases other than -0.25 deg/h" "$wrong" ""
same "events" "$(grep -c 'is implausible' "$dir/prismd.err") $(grep -c 'is plausible again' "$dir/prismd.err")" "5 5"
contains "report of the temperature" "$(cat "$dir/prismd.err")" "temperature is implausible: found -273 degC, expected -90 to 200"
contains "report of the rate" "$(cat "$dir/prismd.err")" "rate is implausible: found 3.4e+38 deg/h"
contains "report of the constant temperature" "$(cat "$dir/prismd.err")" "found 25 degC for 101 s, expected it to change"

# Tools that read the log ignore the faults: they find 8 deg/h throughout.
contains "Allan deviation of a constant rate" "$(prismcal allan "$dir/log" 2>&1 || true)" "expected a rate that varies"

# A range with its limits reversed is rejected.
config_file ', "plausibility": {"temperature": {"range_degc": [30, 20]}}' && sed -i 's/"plausibility": {"temperature": {"stuck_s": 100}}, //' "$dir/gyro.json"
! prismd --check "$dir/gyro.json" 2>"$dir/refused" || fail "accepted a range with its limits reversed"
contains "error" "$(cat "$dir/refused")" "/plausibility/temperature/range_degc: found [30, 20], expected [low, high], low below high"

# Clients are notified, too: a replay at 100 times real time serves the socket. Its temperature is stuck from the 300th second to the end.
seq 1 6000 | awk 'BEGIN { print "t,rate,temperature,uhfo" } { print 1700000000 + $1 ",8," ($1 < 300 ? 25.5 + 0.0015 * ($1 % 2) : 25.5) ",5" }' >"$dir/stuck.csv"
prismcal convert "$dir/stuck.csv" --map rate=rate:deg/h,temperature=temperature:degC,uhfo=uhfo:V,time=t:s --out "$dir/stuck.pcap" >"$dir/convert.out"
config_file ', "socket": {"path": "'"$PRISM_SOCKET"'"}'
start replay prismd "$dir/gyro.json" --replay "$dir/stuck.pcap" --speed 100 --socket "$PRISM_SOCKET" --out "$dir/slow"
wait_for 5 prismctl version
prismctl watch --json >"$dir/watch" & children+=("$!")
is_implausible() { [[ $(field .quality status) == *implausible* && $(field .quality bias) == *implausible* ]]; }
wait_for 20 is_implausible
wait_for 5 grep -q '"quality":"[a-z_+]*implausible' "$dir/watch"
wait_for 5 grep -q '"kind":"implausible"' "$dir/watch"
kill -TERM "$pid"; wait "$pid" || fail "the replay: exit code $?"
