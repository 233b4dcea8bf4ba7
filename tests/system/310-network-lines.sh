# SPDX-License-Identifier: MIT
# A gyro behind a network, as a user sets it up: --check, status, events, and the replay of the capture. A removed key is a warning.
. "$(dirname "$0")/lib.sh"
command -v python3 >/dev/null || skip "no python3"
frames 50
port=$(free_port)
net_config() { # LINE-MEMBERS
  cat >"$dir/gyro.json" <<END
{"line": {$1, "silence_s": 1}, "frames": "$dir/frames.json", "clock": "device", "log": {"directory": "$dir/log"},
 "capture": {"directory": "$dir/bytes"}, "socket": {"path": "$PRISM_SOCKET"}}
END
}
net_config "\"tcp\": {\"address\": \"localhost:$port\"}, \"serve\": {\"raw\": {\"tcp\": {\"listen\": \"127.0.0.1:5001\"}}}"
removed="$dir/gyro.json:/line/serve: removed in prism 0.4 (line 1); it has no effect; let ser2net serve the line to several programs (lines.md)"
contains "the removed key" "$(prismd --check "$dir/gyro.json" 2>&1)" "warning: $removed"
contains "the unit of a network line" "$(prismd --check "$dir/gyro.json" 2>&1)" "line tcp localhost:$port, unit prismd-net@gyro"
start_prismd
wait_for 5 sh -c "prismctl --json status | jq -re .detail | grep -q 'connection refused'"
start sim prismsim --tcp-listen "127.0.0.1:$port" --frames "$dir/frames.json" --profile steady; sim=$pid
wait_for 10 field_is .state status receiving
same "the line's name" "$(field .device status)" "tcp localhost:$port"
# Once at the start, and again after a reload, which a key that stops would reject.
removals() { grep -cF "warning: $removed" "$dir/prismd.err"; }
same "warnings of the removed key" "$(removals)" 1
warned_again() { prismctl reload >/dev/null || fail "a reload with a removed key failed"; [ "$(removals)" = 2 ]; }
wait_for 10 warned_again  # equal events are counted for a while
kill -9 "$sim"
wait_for 5 field_is .state status connecting
start sim prismsim --tcp-listen "127.0.0.1:$port" --frames "$dir/frames.json" --profile steady
wait_for 10 field_is .state status receiving
wait_for 5 field_above .log.rows status "$(field .log.rows status)"
kill -TERM "$prismd"; wait "$prismd" || fail "exit code $?"
start sim prismsim --tcp-listen "127.0.0.1:$port" --frames "$dir/frames.json" --profile steady
sniffs() { prismd --sniff "127.0.0.1:$port" "$dir/frames.json" >"$dir/sniffed"; }
wait_for 10 sniffs
contains "a sniffed network line" "$(cat "$dir/sniffed")" " fits "
same "reports of the loss" "$(grep -c ': lost:' "$dir/prismd.err")" 1
same "reports of the refused connections: at the start only" "$(grep -c 'retrying' "$dir/prismd.err")" 1
prismd "$dir/gyro.json" --replay "$dir"/bytes/*.pcap --out "$dir/again" >/dev/null 2>"$dir/replay.err" || fail "$(cat "$dir/replay.err")"
log_text "$dir"/log/*.csv >"$dir/a"; log_text "$dir"/again/*.csv >"$dir/b"; cmp "$dir/a" "$dir/b" || fail "the replay's log differs"

# The device connects; then datagrams.
net_config "\"tcp\": {\"listen\": \"[::1]:$port\"}"
rm -r "$dir/log" "$dir/bytes"; start_prismd
contains "waiting" "$(field .detail status)" "waiting for a connection to [::1]:$port"
start sim prismsim --tcp "[::1]:$port" --frames "$dir/frames.json" --profile steady; sim=$pid
wait_for 10 field_is .state status receiving
kill -9 "$sim" "$prismd"; wait "$sim" "$prismd" 2>/dev/null || true
net_config "\"udp\": {\"listen\": \"127.0.0.1:$port\", \"from\": \"127.0.0.1\"}"
rm -f "$PRISM_SOCKET"; start_prismd
start sim prismsim --udp "127.0.0.1:$port" --frames "$dir/frames.json" --profile steady
wait_for 10 field_is .state status receiving
wait_for 5 field_above .decoder.frames line 100
same "missing frames" "$(field .timing.missing_frames line)" 0

# A stranger at a line that listens is replaced by the gyro; then it is turned away.
port=$(free_port)
net_config "\"tcp\": {\"listen\": \"127.0.0.1:$port\"}"
kill -9 "$prismd"; wait "$prismd" 2>/dev/null || true
rm -f "$PRISM_SOCKET"; start_prismd
drip='import socket, sys, time
line = socket.create_connection(("127.0.0.1", int(sys.argv[1])), source_address=(sys.argv[2], 0))
while True: line.send(b"x"); time.sleep(0.3)'
start stranger python3 -c "$drip" "$port" 127.0.0.9
wait_for 5 field_is .state status receiving
start sim prismsim --tcp "127.0.0.1:$port" --frames "$dir/frames.json" --profile steady; sim=$pid
wait_for 20 field_above .decoder.frames line 100
contains "the stranger" "$(cat "$dir/prismd.err")" 'lost: 127.0.0.9 sent no frame for 1 s and is replaced by 127.0.0.1; no frame came, but "xx'
start stranger python3 -c "$drip" "$port" 127.0.0.8
problems() { prismctl --json status | jq -r '.health.problems[].text'; }
wait_for 5 sh -c "$(declare -f problems); problems | grep -q ': 127.0.0.8 is turned away: 127.0.0.1 is connected'"

# Only one host may connect.
kill -9 "$sim"
net_config "\"tcp\": {\"listen\": \"127.0.0.1:$port\", \"from\": \"127.0.0.7\"}"
prismctl reload >/dev/null || fail "the reload with \"from\" failed"
start stranger python3 -c "$drip" "$port" 127.0.0.8
wait_for 5 sh -c "$(declare -f problems); problems | grep -q ': 127.0.0.8 is turned away: only 127.0.0.7 may connect'"
start gyro python3 -c "$drip" "$port" 127.0.0.7
wait_for 5 field_is .state status receiving

# A server that greets in Telnet and closes: its text is shown, and the pauses grow.
greet='import socket, sys, time
server = socket.create_server(("127.0.0.1", int(sys.argv[1])))
print("listens", flush=True)
while True: peer = server.accept()[0]; peer.send(b"\xff\xfb\x01login: "); peer.close(); print(time.monotonic(), flush=True)'
kill -9 "$prismd"; wait "$prismd" 2>/dev/null || true
port=$(free_port)
start server python3 -c "$greet" "$port"
wait_for 20 grep -q listens "$dir/server.out"  # else the pauses grow before it
net_config "\"tcp\": {\"address\": \"127.0.0.1:$port\"}, \"retry_min_s\": 0.05, \"retry_max_s\": 60"
rm -f "$PRISM_SOCKET"; start_prismd
wait_for 20 sh -c "[ \$(wc -l <'$dir/server.out') -ge 7 ]"
awk '{ if (NR > 2 && $1 - last < 1.5 * pause) exit 1; pause = $1 - last; last = $1 }' <(tail -4 "$dir/server.out") || fail "pauses: $(cat "$dir/server.out")"
contains "what came" "$(field .detail status)" 'the other end closed the connection; no frame came, but "\xff\xfb\x01login: "'
contains "Telnet" "$(cat "$dir/prismd.err")" "the other end speaks Telnet (FF FB 01): set the port of the device server to raw TCP"

# A Telnet server without greeting doubles each byte FF.
double='import socket, sys
peer = socket.create_server(("127.0.0.1", int(sys.argv[2]))).accept()[0]
gyro = socket.create_connection(("127.0.0.1", int(sys.argv[1])))
while True: peer.sendall(gyro.recv(999).replace(b"\xff", b"\xff\xff"))'
kill -9 "$prismd"; wait "$prismd" 2>/dev/null || true
far=$(free_port) port=$(free_port)
start sim prismsim --tcp-listen "127.0.0.1:$far" --frames "$dir/frames.json" --profile steady
start telnet python3 -c "$double" "$far" "$port"
net_config "\"tcp\": {\"address\": \"127.0.0.1:$port\"}, \"retry_max_s\": 0.2"
rm -f "$PRISM_SOCKET"; start_prismd
wait_for 20 grep -q 'each byte FF came twice, [0-9]* times, and frames with it are damaged: the other end speaks Telnet: set the port' "$dir/prismd.err"

# Mistakes name the missing part.
refused() { # TEXT LINE-MEMBERS
  net_config "$2"
  code=0; prismd "$dir/gyro.json" --check 2>"$dir/e" >/dev/null || code=$?
  same "exit code: $2" "$code" 78
  contains "$2" "$(cat "$dir/e")" "$1"
}
refused '/line/tcp/address: found "moxa" without a port, expected HOST:PORT' '"tcp": {"address": "moxa"}'
refused '/line/tcp/address: found ":4001" without a host, expected HOST:PORT' '"tcp": {"address": ":4001"}'
refused '/line/tcp/listen: found "::1:4001", an IPv6 address without brackets; expected [ADDRESS]:PORT' '"tcp": {"listen": "::1:4001"}'
refused '/line/udp: "listen" is missing' '"udp": {}'
refused '/line/tcp: given together with "device"; expected one of them' '"device": "tty", "tcp": {"address": "moxa:4001"}'
refused '/line/tcp/from: given with "address"; expected "listen"' '"tcp": {"address": "moxa:4001", "from": "192.0.2.7"}'
refused '/line/tcp/from: has a port, which a peer that connects chooses itself; expected an address' '"tcp": {"listen": "[::]:4001", "from": "192.0.2.7:4001"}'
