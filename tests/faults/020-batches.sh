# SPDX-License-Identifier: MIT
# Batches, many lines at once, notifications and disconnects of some clients do not delay acquisition. 5 s of SIGSTOP do not count as
# a line without data. History: one line of 65 kB blocked the live thread for 21 to 30 s, and the line lost 3 458 of 4 973 frames.
. "$(dirname "$0")/lib.sh"
config
sed -i 's/"silence_s": 1/"silence_s": 3/' "$dir/gyro.json"
start_sim --profile steady --speed 1
start_prismd
wait_for 10 field_is .state status receiving
python3 - "$PRISM_SOCKET" <<'END' || fail "see above"
import json, socket, sys, threading, time
def connect():
    s = socket.socket(socket.AF_UNIX); s.connect(sys.argv[1]); return s
def ask(s, text):
    s.sendall(text.encode() + b"\n"); data = b""
    while not data.endswith(b"\n"): data += s.recv(1 << 20)
    return data
request = lambda i, m, p="{}": '{"jsonrpc":"2.0","id":%d,"protocol":2,"method":"%s","params":%s}' % (i, m, p)
answer = json.loads(ask(connect(), "[" + ",".join(request(i, "version") for i in range(101)) + "]"))
assert "a batch of 101 requests, expected at most 100" in answer["error"]["message"], answer
s = connect(); s.settimeout(60)
s.sendall(("[" + ",".join(request(i, "version") for i in range(100)) + "]\n").encode())
data = b""
while data.count(b"\n") < 100: data += s.recv(1 << 20)
assert [json.loads(line)["id"] for line in data.splitlines()] == list(range(100)), "expected one response per request, in order"
# Nine threads connect, flood prismd with requests and disconnect, for 3 s.
stop = False
def abuse(kind):
    while not stop:
        try:
            s = connect(); s.settimeout(5)
            if kind == 0: s.sendall(("[" + ",".join(request(i, "status") for i in range(100)) + "]\n").encode())
            if kind == 1: s.sendall(((request(1, "history", '{"seconds":3600}') + "\n") * 600).encode())
            if kind == 2: s.sendall((('{"jsonrpc":"2.0","method":"status"}\n') * 1500).encode())
            if kind < 2: s.recv(1 << 16)
            s.close()
        except OSError: pass
threads = [threading.Thread(target=abuse, args=(i % 3,), daemon=True) for i in range(9)]
for thread in threads: thread.start()
time.sleep(3)
stop = True
END
wait_for 10 field_is .state status receiving
same "sessions" "$(field .sessions status)" 1
same "frames lost" "$(field .timing.missing_frames status)" 0
[ "$(grep -c 'no data for' "$dir/prismd.err" || true)" = 0 ] || fail "a false report of a line without data: $(cat "$dir/prismd.err")"

kill -STOP "$prismd"; sleep 5; kill -CONT "$prismd"
wait_for 10 field_is .state status receiving
grows .log.rows status 2
same "sessions after a stall" "$(field .sessions status)" 1
[ "$(grep -c 'no data for' "$dir/prismd.err" || true)" = 0 ] || fail "a stall reported as a line without data: $(cat "$dir/prismd.err")"
kill "$prismd"; wait "$prismd" || fail "prismd: exit code $?"
kill "$sim"; wait "$sim" || fail "prismsim: exit code $?"

# A line without flow control (--overrun) and a counter that wraps every 0.128 s: frames lost in a stall of 5 s are counted all
# the same.
cp "$PRISM_SOURCE/config/frames/kvh1750.json" "$dir/frames.json"
sed -i 's/"clock": "device"/"clock": "host"/; s|, *"model": "[^"]*"||; /"model":/d' "$dir/gyro.json"
start_sim --profile steady --rate 1000 --overrun --wait
start_prismd
wait_for 10 field_is .state status receiving
grows .decoder.frames line 500
kill -STOP "$prismd"; sleep 5; kill -CONT "$prismd"
grows .decoder.frames line 1500
kill "$sim"; wait "$sim" || fail "prismsim: exit code $?"
wait_for 5 field_is .state status connecting
sent=$(sed -n 's/.*: \([0-9]*\) simulated frames.*bytes lost to a slow reader.*/\1/p' "$dir/sim.err")
# A frame whose counter is that of the frame before the stall is a duplicate (one stall of 128), and one more is missing.
read -r came lost by_arrival <<<"$(prismctl --json line | jq -r '"\(.decoder.frames - .timing.duplicates) \(.timing.missing_frames) \(.timing.missing_by_arrival)"')"
[ "$lost" -gt 4000 ] || fail "in a stall of 5 s: found $lost of $sent frames missing, expected most of 5000"
unknown=$((sent - came - lost))  # sent while the line was opened or closed; a missed counter wrap would be 128
[ "$unknown" -ge 0 ] && [ "$unknown" -le 100 ] || fail "found $came frames received and $lost missing, expected a sum of $sent"
[ "$by_arrival" -gt 3500 ] && [ "$by_arrival" -le "$lost" ] || fail "missing by arrival: found $by_arrival, expected 3501 to $lost"
contains "events" "$(prismctl --json events)" '"frames_lost"'
