# SPDX-License-Identifier: MIT
# Start-up commands and polls: on a pseudo-terminal and on TCP, after each reconnection, with answers that do not come; sent bytes are in the
# capture, and a replay ignores them.
. "$(dirname "$0")/lib.sh"
command -v python3 >/dev/null || skip "no python3"
here=$PRISM_SOURCE/tests/system
start='"start": [{"send": "SERVICEMODE\r", "expect": "OK\r\n"}, {"wait_ms": 50}, {"send_hex": "55 AA 01 FE"}], "stop": [{"send": "x\r", "expect": "BYE"}], "again_when_silent": true'
jq ". + {$start, rate_hz: 50}" <(sed 's|^ *//.*||' "$PRISM_SOURCE/config/frames/trplg.json") >"$dir/frames.json"
config '"capture": {"directory": "'"$dir/bytes"'"}'
sed -i 's/"silence_s": 1/"silence_s": 60/' "$dir/gyro.json"  # on a slow machine, the gyro may be silent for seconds

# prismsim streams only after the commands; prismd restarts it after each reconnection.
start_sim --profile steady --obey
start_prismd
wait_for 5 field_is .state status receiving
kill -9 "$sim"; rm -f "$dir/tty"; wait_for 5 field_is .state status connecting
rm -f "$dir/tty"; start_sim --profile steady --obey
wait_for 5 field_is .state status receiving
wait_for 5 field_above .log.rows status $(($(field .log.rows status) + 1))
prismctl send 'hello\r' 2>"$dir/e" && fail "sent without allow_send"
contains "send without allow_send" "$(cat "$dir/e")" 'the configuration does not allow it; expected "allow_send": true'
kill -TERM "$prismd"; wait "$prismd" || fail "exit code $?"
python3 - "$dir"/bytes/*.pcap <<'END' || fail "the sent bytes of the capture"
import struct, sys
data = open(sys.argv[1], "rb").read()
at, sent = 24, []
while at < len(data):
    size = struct.unpack_from("<I", data, at + 8)[0]
    if data[at + 24] == 1:
        sent.append(data[at + 28 : at + 16 + size])
    at += 16 + size
begin = [b"SERVICEMODE\r", b"\x55\xaa\x01\xfe"]
assert sent == begin + begin + [b"x\r"], sent
END
if command -v tshark >/dev/null; then
  same "sent records in tshark" "$(tshark -r "$(echo "$dir"/bytes/*.pcap)" -Y 'rtacser.eventtype == 1' 2>/dev/null | wc -l)" 5
fi
prismd "$dir/gyro.json" --replay "$dir"/bytes/*.pcap --out "$dir/again" >/dev/null 2>"$dir/replay.err" || fail "$(cat "$dir/replay.err")"
log_text "$dir"/log/*.csv >"$dir/a"; log_text "$dir"/again/*.csv >"$dir/b"; cmp "$dir/a" "$dir/b" || fail "the replay's log differs"

# A device that answers something else: one event, the step in the status, and its frames are served meanwhile.
start wrong python3 -c '
import os, pty, sys, termios, time
master, slave = pty.openpty()
mode = termios.tcgetattr(slave); mode[0] = mode[1] = mode[3] = 0; termios.tcsetattr(slave, termios.TCSANOW, mode)
os.symlink(os.ttyname(slave), sys.argv[1])
while True:
    if os.read(master, 100).endswith(b"\r"): os.write(master, b"ERR")' "$dir/wrong"
sed -i "s|\"device\": \"[^\"]*\"|\"device\": \"$dir/wrong\", \"allow_send\": true|; s/\"silence_s\": 60/\"silence_s\": 0.3/" "$dir/gyro.json"
: >"$dir/prismd.err"; rm -rf "$dir/log" "$dir/bytes"
wait_for 5 test -e "$dir/wrong"
start_prismd
wait_for 5 sh -c "prismctl --json status | jq -re .detail | grep -q 'start-up: step 1 of 3: expected OK, received 45 52 52'"
attempts() { [ "$(cat "$dir"/bytes/*.pcap | grep -ao SERVICEMODE | wc -l)" -ge 3 ]; }
wait_for 10 attempts
same "reports of the failed start-up" "$(grep -c 'start-up: step' "$dir/prismd.err")" 1
kill -TERM "$prismd"; wait "$prismd" || fail "exit code $?"

# prismctl send: root or the own user only, one event each.
sed -i "s|\"allow_send\": true|\"allow_send\": true, \"start\": [], \"stop\": []|; s|$dir/wrong|$dir/tty|" "$dir/gyro.json"
rm -f "$dir/tty"; kill -9 "$sim" 2>/dev/null || true; start_sim --profile steady
start_prismd
wait_for 5 field_is .state status receiving
same "send" "$(prismctl send '=config,0\r\n')" "sent 11 bytes"
same "send in hex" "$(prismctl send --hex 'FA FF 10')" "sent 3 bytes"
same "events of sent bytes" "$(prismctl events | grep -c ': sent ')" 2
kill -TERM "$prismd"; wait "$prismd" || fail "exit code $?"

# The three described instruments; one poller after reconnections, periods without drift, missed replies counted.
poll() { # DESCRIPTION SENSOR KIND PERIOD_MS [HABIT]
  start therm python3 "$here/instrument.py" "$3" "$dir/therm" ${5:-}; therm=$pid
  wait_for 5 test -e "$dir/therm"
  cat >"$dir/gyro.json" <<END
{"line": {"device": "$dir/tty", "silence_s": 1, "start": []}, "frames": "$dir/frames.json", "clock": "device", "axes": {"z": {}},
 "log": {"directory": "$dir/log-$1${5:-}"}, "capture": {"directory": "$dir/bytes-$1${5:-}"}, "socket": {"path": "$PRISM_SOCKET"},
 "sensor_lines": {"room": {"device": "$dir/therm", "frames": "$1", "retry_min_s": 0.05, "stale_after_s": 2, "poll": $4}}}
END
  start_prismd
}
end_poll() { kill -TERM "$prismd"; wait "$prismd" || fail "exit code $?"; kill -9 "$therm"; rm -f "$dir/therm"; }
value_above() { [ "$(field ".sensors[\"room.$1\"].value > $2" status)" = true ]; }
request='{"every_ms": 200, "within_ms": 100, "requests": [{"send_hex": "01 03 00 00 00 08 44 0C"}]}'
poll comwintop-8pt1000 t1 modbus "$request"
wait_for 10 value_above t8 20
requests() { field .sensor_lines.room.polls.requests line; }
requests_above() { [ "$(requests)" -gt "$1" ]; }
for _ in 1 2 3; do  # unplugged and plugged in again
  kill -9 "$therm"; rm -f "$dir/therm"
  wait_for 5 field_is .sensor_lines.room.state status connecting
  start therm python3 "$here/instrument.py" modbus "$dir/therm"; therm=$pid
  wait_for 5 test -s "$dir/therm.out"
done
before=$(requests) begin=$(date +%s%N)
changed() {  # prismd's counter changes once a second
  local now; now=$(date +%s%N)
  first=$(requests)
  [ "$first" != "$before" ] || { begin=$now; false; }
}
wait_for 5 changed
first_arrived=$(wc -l <"$dir/therm.out")
wait_for 5 requests_above $((first + 9))
polls=$(($(requests) - first)) arrived=$(($(wc -l <"$dir/therm.out") - first_arrived)) took_ms=$((($(date +%s%N) - begin) / 1000000))
[ "$polls" -le $((took_ms / 200 + 2)) ] || fail "found $polls polls in $took_ms ms, expected at most one in 200 ms: one poller"
[ "$arrived" -le $((polls * 3 / 2 + 2)) ] || fail "found $arrived polls at the instrument, $polls of prismd: one poller"
end_poll
poll scpi-thermometer temperature scpi '{"every_ms": 600, "within_ms": 500, "send": "MEAS:TEMP?\n"}' mute
wait_for 10 value_above temperature 20.4
wait_for 10 field_above .sensor_lines.room.polls.missed line 2
missed=$(field .sensor_lines.room.polls.missed line) requests=$(field .sensor_lines.room.polls.requests line)
[ "$missed" -ge 3 ] && [ $((requests / missed)) -ge 2 ] || fail "found $missed missed of $requests requests, expected every third"
same "events of missed replies" "$(prismctl events | grep -c missed || true)" 0
end_poll
poll weiss-simcon32 temperature weiss '{"every_ms": 200, "within_ms": 100, "send": "$00I\r"}'
wait_for 10 value_above temperature 20.2
same "nominal value" "$(field '.sensors["room.nominal"].value * 1' status)" 23
end_poll
prismd "$dir/gyro.json" --replay "$dir"/bytes-weiss-simcon32/*.pcap --out "$dir/polled" >/dev/null 2>"$dir/replay.err" || fail "$(cat "$dir/replay.err")"
log_text "$dir"/log-weiss-simcon32/*.csv >"$dir/a"; log_text "$dir"/polled/*.csv >"$dir/b"; cmp "$dir/a" "$dir/b" || fail "the replay's log differs"

# A device that sends rubbish for ever costs little.
poll scpi-thermometer temperature scpi '{"every_ms": 200, "within_ms": 100, "send": "MEAS:TEMP?\n"}' rubbish
used() { awk '{print $14 + $15}' "/proc/$prismd/stat"; }
skipped() { field .sensor_lines.room.decoder.skipped_bytes line; }
skipped_above() { [ "$(skipped)" -gt "$1" ]; }
wait_for 5 skipped_above 0
before=$(used) from=$(skipped)
wait_for 10 skipped_above $((from + 50000))
ticks=$(($(used) - before)) bytes=$(($(skipped) - from))
echo "CPU: $ticks ticks for $bytes bytes of rubbish"
[ "$ticks" -le $((bytes / 2000)) ] || fail "found $ticks ticks of CPU time for $bytes bytes, expected at most one for 2000 (with the gyro's 50 Hz and these questions)"
end_poll
