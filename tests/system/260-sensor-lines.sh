# SPDX-License-Identifier: MIT
# A thermometer on its own line measures T for a gyro without one; the captures of both lines are used for training and correction.
# Live, it is unplugged and plugged in again: only dependent values are unknown meanwhile, and the replay of both captures writes the
# live log, byte for byte.
. "$(dirname "$0")/lib.sh"
command -v python3 >/dev/null || skip "no python3"
here=$PRISM_SOURCE/tests/system
sed 's/^\( *"rate_hz": \)[0-9.]*/\110/' "$PRISM_SOURCE/config/frames/dsp3000.json" >frames.json
config() { # AXIS-MEMBERS [COLUMNS]: prints a configuration; COLUMNS are more columns of the sensor line
  cat <<END
{"name": "fog", "frames": "frames.json", "clock": "device", "line": {"device": "tty", "silence_s": 1, "retry_min_s": 0.05},
 "socket": {"path": "$PRISM_SOCKET"}, "log": {"directory": "live"}, "capture": {"directory": "bytes"}, "site": {"latitude_deg": 34.25},
 "axes": {"z": {"elevation_deg": 90, $1}},
 "sensor_lines": {"chamber": {"device": "chamber", "retry_min_s": 0.05, "stale_after_s": 2,
   "columns": {"temperature": {"column": 2, "unit": "degC"}${2:-}}}}}
END
}
record() { # DIRECTORY SEED: writes captures of both lines
  mkdir -p "$1/chamber"
  prismsim --frames frames.json --smooth --profile fast --hours 8 --seed "$2" --truth truth.csv --out "$1/fog.pcap" 2>/dev/null
  python3 "$here/thermometer.py" truth.csv "$1/chamber/fog-chamber.pcap"
}
record one 1; record two 2
config '"temperature": "chamber.temperature"' >train.json
prismcal train one/fog.pcap --config train.json --inputs T,dTdt --method stepwise --quiet --out fog.json >/dev/null || fail "training on the captures"
config '"temperature": "chamber.temperature", "model": "./fog.json"' >fog-z.json
prismd fog-z.json --replay two/fog.pcap --out corrected >summary 2>replay.err || fail "the corrected replay: $(cat replay.err)"
gain=$(sed -n 's/^bias stability.*improvement \(.*\) %/\1/p' summary)
awk -v gain="$gain" 'BEGIN {exit !(gain > 20)}' || fail "found an improvement of '$gain' %, expected more than 20: $(cat summary)"
prismd fog-z.json --replay two/fog.pcap --replay-sensors chamber=two/chamber/fog-chamber.pcap --out named >/dev/null
cat corrected/fog-z-*.csv >a; cat named/fog-z-*.csv >b; cmp a b || fail "a capture given by --replay-sensors gives another log"
contains "metadata" "$(head -30 a)" "# sensor_line: chamber ascii-columns "
contains "metadata" "$(head -30 a)" "# temperature: chamber.temperature"
contains "columns" "$(grep -m1 ^time_utc a)" ",chamber.temperature_degc,"
prismcal train named --inputs chamber.temperature,dchamber.temperature/dt --method stepwise --quiet --out own.json >/dev/null || fail "training on the log"
config '"temperature": "chamber.temperature", "uhfo": "chamber.u"' ', "u": {"column": 2, "unit": "V"}' >both.json
prismd both.json --replay two/fog.pcap --out both >/dev/null
contains "metadata" "$(cat both/*.csv | head -30)" "# uhfo: chamber.u"
same "rows whose U is the number of the line" "$(awk -F, '/^[0-9]/ {print ($7 != "" && ($7 - $6) ^ 2 < 1e-8) ? "U" : "none"}' both/*.csv | sort | uniq -c | sort -rn | awk 'NR == 1 {print ($1 > 28000), $2}')" "1 U"
prismcal train two/fog.pcap --config both.json --inputs U --method stepwise --force --quiet --out u.json >/dev/null || fail "training on the voltage of a sensor line"
mv two/chamber two/elsewhere
prismd fog-z.json --replay two/fog.pcap --out without >/dev/null 2>without.err || true
contains "a missing capture" "$(cat without.err)" "chamber: found no capture of this sensor line; its values are unknown"
code=0; prismd fog-z.json --replay two/fog.pcap --replay-sensors oven=one/fog.pcap 2>wrong.err >/dev/null || code=$?
contains "an unknown sensor line" "$(cat wrong.err)" 'found no sensor line "oven"'
# A wrong file was accepted without a word.
code=0; prismd fog-z.json --replay two/fog.pcap --replay-sensors chamber=/etc/hostname --out wrong 2>wrong.err >/dev/null || code=$?
same "exit code: a file without a value" "$code" 1
contains "a file without a value" "$(cat wrong.err)" "/etc/hostname: found no value in $(wc -c </etc/hostname) bytes, the first line is \"$(head -n 1 /etc/hostname)\"; expected temperature of the sensor line chamber, described by ascii-columns"
printf '1,20.5\r\n2,20.6\r\n3,20.7\r\n' >late.txt
prismd fog-z.json --replay two/fog.pcap --replay-sensors chamber=late.txt --out late 2>late.err >/dev/null || true
contains "a file of another time" "$(cat late.err)" "chamber: its capture is from 1970-01-01T"
contains "a file of another time" "$(cat late.err)" "no common time, so its values are unknown"

# Configuration errors.
refused() { # WHAT EXPECTED: wrong.json must be rejected with this text
  code=0; prismd wrong.json --check 2>wrong.err >/dev/null || code=$?
  same "exit code: $1" "$code" 78
  contains "$1" "$(cat wrong.err)" "$2"
}
jq 'del(.axes) + {gyro: {axis: "z"}}' fog-z.json >wrong.json; refused "no axes" '/sensor_lines: given without "axes"'
jq '.axes.z.temperature = "oven.temperature"' fog-z.json >wrong.json; refused "no such thermometer" '/axes/z/temperature: found oven.temperature, expected a sensor of dsp3000: chamber.temperature'
jq '.axes.z.uhfo = "chamber.temperature"' fog-z.json >wrong.json; refused "a voltage in degC" '/axes/z/uhfo: found chamber.temperature in degC, expected a sensor in V'
jq 'del(.sensor_lines.chamber.columns)' fog-z.json >wrong.json; refused "no columns" 'ascii-columns.json: found no sensor with a name, expected at least one; name them in "columns" of the sensor line chamber'
jq '.sensor_lines.chamber.frames = "trplg"' fog-z.json >wrong.json; refused "a gyro's frames" 'trplg.json'
jq '.frames = "lutron-btm4208sd"' fog-z.json >wrong.json; refused "no gyro" 'found no gyro, expected one'
jq 'del(.sensor_lines.chamber.columns.temperature.unit)' fog-z.json >wrong.json; refused "no unit" '/sensor_lines/chamber/columns/temperature: "unit" is missing'
jq '.sensor_lines.chamber.device = "tty"' fog-z.json >wrong.json; refused "the same line twice" "is another line of this configuration"
jq '.axes.z.model = "./own.json" | del(.sensor_lines, .axes.z.temperature)' fog-z.json >wrong.json
refused "a model with a missing sensor" 'found chamber.temperature, expected a sensor of dsp3000: none'

# Live.
config '"model": "./own.json"' ', "pressure": {"column": 3, "unit": "Pa"}' >live.json
start therm python3 "$here/thermometer.py" --link "$dir/chamber"; therm=$pid
start sim prismsim --frames frames.json --profile steady --link "$dir/tty" --wait
wait_for 5 test -e tty -a -e chamber
start prismd prismd live.json; daemon=$pid
wait_for 5 prismctl version
known() { prismctl --json status | jq -e ".sensors[\"chamber.temperature\"].value | type == \"number\""; }
unknown() { ! known; }
wait_for 10 known
prismctl status >status.out
contains "status" "$(cat status.out)" "chamber      receiving, last value"
contains "status" "$(cat status.out)" "chamber.pressure 101325.000 Pa"
awk 'length($0) > 80 && !/^line|\// {exit 1}' status.out || fail "wider than 80 columns: $(cat status.out)"
same "the line" "$(field .sensor_lines.chamber.state line)" receiving
timeout 60 prismctl --json watch --count 2 >watch.out
wait_for 10 sh -c "timeout 60 prismctl --json watch --count 2 | jq -e '.params.sensors[\"chamber.temperature\"] > 19'"
kill -9 "$therm"
rm chamber  # as udev does; the number of its pty may soon be that of another test's
wait_for 10 unknown
wait_for 10 sh -c "timeout 60 prismctl --json watch --count 2 | jq -e '.params.sensors[\"chamber.temperature\"] == null and .params.samples'"
same "state of the gyro" "$(field .state status)" receiving
wait_for 5 field_is .sensor_lines.chamber.state status connecting
contains "the event" "$(prismctl events)" "chamber: "
start therm python3 "$here/thermometer.py" --link "$dir/chamber"
wait_for 10 known
jq '.sensor_lines.oven = .sensor_lines.chamber | .sensor_lines.oven.device = "oven"' live.json >other.json; cp live.json kept.json; cp other.json live.json
code=0; prismctl reload 2>reload.err || code=$?
contains "a reload with another line" "$(cat reload.err)" "found sensor lines chamber, oven, expected chamber as before"
cp kept.json live.json
wait_for 5 known
wait_for 10 field_above .log.rows status $(($(field .log.rows status) + 2))
kill -TERM "$daemon"; wait "$daemon" || fail "exit code $?"
prismd live.json --replay bytes/fog-*.pcap --out again >/dev/null 2>again.err || fail "$(cat again.err)"
log_text live/fog-z-*.csv >a; log_text again/fog-z-*.csv >b
cmp a b || fail "the replay's log differs from the live one: $(diff a b | head -6)"
same "seconds with and without the thermometer" "$(awk -F, '/^time_utc/ {for (i = 1; i <= NF; ++i) if ($i == "chamber.temperature_degc") c = i; next} !/^#/ && c {n[$c != ""]++} END {print (n[0] > 0) (n[1] > 0)}' a)" 11

# The host clock is set back and forth while both lines send data: each step starts a session, and the replay of the captures writes
# the same log.
fake=$(find /usr/lib -name libfaketimeMT.so.1 -print -quit 2>/dev/null || true)
[ -n "$fake" ] || { echo "not tested: clock steps (libfaketime is not installed; run tools/setup)"; exit 0; }
jq '.clock = "host" | .log.directory = "stepped" | .capture.directory = "stepped-bytes"' live.json >stepped.json
echo '+0' >offset
start stepped env LD_PRELOAD="$fake" FAKETIME_TIMESTAMP_FILE="$dir/offset" FAKETIME_NO_CACHE=1 FAKETIME_DONT_FAKE_MONOTONIC=1 \
  prismd stepped.json
daemon=$pid
wait_for 5 prismctl version
wait_for 10 known
for offset in -40.5 -20 -60.25; do
  wait_for 10 field_above .log.rows status $(($(field .log.rows status) + 1))
  steps=$(grep -c 'host clock stepped' stepped.err || true)
  echo "$offset" >offset
  wait_for 5 sh -c "[ \$(grep -c 'host clock stepped' stepped.err) -gt ${steps:-0} ]"
done
wait_for 10 field_above .log.rows status $(($(field .log.rows status) + 2))
kill -TERM "$daemon"; wait "$daemon" || fail "exit code $?"
prismd stepped.json --replay stepped-bytes/fog-*.pcap --out unstepped >/dev/null 2>again.err || fail "$(cat again.err)"
log_text stepped/fog-z-*.csv >a; log_text unstepped/fog-z-*.csv >b
cmp a b || fail "the log of the replay across clock steps differs: $(diff a b | head -6)"
[ "$(grep -c '^# session' a)" -ge 4 ] || fail "found less than 4 sessions, expected one more per step: $(grep '^# session' a)"
