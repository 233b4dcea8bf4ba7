# SPDX-License-Identifier: MIT
# Frames that arrive at another rate than described: event, status, quality and exit code; and --check of a capture, stage by stage.
. "$(dirname "$0")/lib.sh"
described=200
differ='frames arrive at 10.00 a second, the description says 200 (rate_hz)'
config
jq 'del(.accept_clock)' "$dir/gyro.json" >"$dir/strict.json"

# live: 10 frames a second
frames 10
start_sim --profile steady --speed 1
frames $described
cp "$dir/strict.json" "$dir/gyro.json"
start_prismd
wait_for 20 grep -q "warning: frames arrive at [0-9.]* a second, the description says 200" "$dir/prismd.err"
contains "status" "$(field .clocks_differ status)" "a second, the description says 200 (rate_hz)"
contains "prismctl status" "$(prismctl status)" "a second, the description says 200 (rate_hz)"
contains "quality" "$(field .quality status)" clocks_differ
same "no corrected rate" "$(field .corrected_deg_per_h bias)" null
kill -TERM "$prismd"; wait "$prismd" || fail "exit code $?"
contains "the log" "$(tail -n 2 "$dir"/log/*.csv)" clocks_differ

# the same in a replay
frames 10
prismsim --profile steady --hours 0.05 --frames "$dir/frames.json" --out "$dir/slow.pcap" 2>/dev/null
frames $described
replay() { code=0; prismd "$dir/strict.json" --replay "$dir/slow.pcap" --out "$dir/$1" "${@:2}" >"$dir/o" 2>"$dir/e" || code=$?; }
replay differs
same "a replay: exit code" "$code" 3
contains "a replay" "$(cat "$dir/e")" "$differ; correct the description, or accept it with --accept-clock"
contains "the replay's log" "$(cat "$dir"/differs/*.csv)" clocks_differ
replay accepted --accept-clock
same "an accepted clock: exit code" "$code" 0
! grep -q clocks_differ "$dir"/accepted/*.csv || fail "an accepted clock is marked"
contains "prismcal" "$("$PRISM_BIN/tools/prismcal/prismcal" allan "$dir/differs" 2>&1 || true)" "found 0 values"  # none is used

# --check of a capture
replay none --check
same "--check: exit code" "$code" 3
frames 10
replay none --check
same "--check of a good capture: exit code" "$code" 0
stage() { awk -v stage="$1" '$1 == stage {print $2}' "$dir/o"; }
same "--check: frames" "$(stage frames)" 1800
same "--check: samples" "$(stage samples)" 1799
same "--check: seconds" "$(stage seconds)" 180
[ ! -e "$dir/none" ] || fail "--check wrote a log"

# a text column that is never a number: --check names the stage and an example
cat >"$dir/text.json" <<'END'
{"format": "prism-frames", "version": 1, "name": "text", "line": {"baud": 9600}, "rate_hz": 10,
 "kinds": [{"name": "line", "after": "0A", "length": {"terminator": "0A", "min": 4, "max": 20}, "text": {"separators": ";", "columns": 2},
   "fields": {"rate": {"column": 1, "type": "decimal", "unit": "deg/h"}}}],
 "gyro": {"meaning": "rate", "unit": "deg/h", "axes": {"z": "rate"}}}
END
for i in $(seq 500); do echo "$i;1,25"; done >"$dir/comma.txt"
jq "del(.model) | .frames = \"$dir/text.json\"" "$dir/strict.json" >"$dir/comma.json"
code=0; prismd "$dir/comma.json" --check --replay "$dir/comma.txt" >"$dir/o" 2>"$dir/e" || code=$?
same "--check of a decimal comma: exit code" "$code" 1
contains "--check of a decimal comma" "$(tail -1 "$dir/e")" 'no number for axis z, for example "'
same "--check of a decimal comma: rates" "$(stage rates)" 0
