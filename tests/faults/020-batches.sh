# SPDX-License-Identifier: MIT
# One line with a batch, many lines at once, notifications, and clients that leave: nobody else waits for them. 5 s of SIGSTOP are
# no silence. The story: one line of 65 kB held the live thread for 21 to 30 s, and the line lost 3 458 of 4 973 frames.
. "$(dirname "$0")/lib.sh"
config
start_sim --profile steady --speed 1
start_prismd
wait_for 10 field_is .state status receiving
sleep 2
python3 - "$PRISM_SOCKET" <<'END' || fail "see above"
import json, socket, sys, threading, time
def connect():
    s = socket.socket(socket.AF_UNIX); s.connect(sys.argv[1]); return s
def ask(s, text):
    s.sendall(text.encode() + b"\n"); data = b""
    while not data.endswith(b"\n"): data += s.recv(1 << 20)
    return data
request = lambda i, m, p="{}": '{"jsonrpc":"2.0","id":%d,"method":"%s","params":%s}' % (i, m, p)
answer = json.loads(ask(connect(), "[" + ",".join(request(i, "version") for i in range(101)) + "]"))
assert "a batch of 101 requests, expected at most 100" in answer["error"]["message"], answer
s = connect(); s.settimeout(20)
s.sendall(("[" + ",".join(request(i, "version") for i in range(100)) + "]\n").encode())
data = b""
while data.count(b"\n") < 100: data += s.recv(1 << 20)
assert [json.loads(line)["id"] for line in data.splitlines()] == list(range(100)), "each answered, in order"
# Abuse by ten clients while another asks again and again: the longest wait is told.
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
time.sleep(6)
stop = True
END
wait_for 10 field_is .state status receiving
same "sessions" "$(field .sessions status)" 1
same "frames lost" "$(field .timing.missing_frames status)" 0
[ "$(grep -c 'no data for' "$dir/prismd.err" || true)" = 0 ] || fail "a false silence: $(cat "$dir/prismd.err")"

kill -STOP "$prismd"; sleep 5; kill -CONT "$prismd"
wait_for 10 field_is .state status receiving
sleep 1.5
same "sessions after a stall" "$(field .sessions status)" 1
[ "$(grep -c 'no data for' "$dir/prismd.err" || true)" = 0 ] || fail "a stall taken for silence: $(cat "$dir/prismd.err")"
kill "$prismd"; wait "$prismd" || fail "the end of prismd: exit code $?"
kill "$sim"; wait "$sim" || fail "the end of prismsim: exit code $?"

# A line that waits for nobody, and a counter of 0.128 s: what 5 s did not leave room for is counted all the same.
cp "$PRISM_SOURCE/config/frames/kvh1750.json" "$dir/frames.json"
sed -i 's/"clock": "device"/"clock": "host"/; s|, *"model": "[^"]*"||; /"model":/d' "$dir/gyro.json"
start_sim --profile steady --rate 1000 --overrun --wait
start_prismd
wait_for 10 field_is .state status receiving
sleep 2
kill -STOP "$prismd"; sleep 5; kill -CONT "$prismd"
sleep 3
kill "$sim"; wait "$sim" || fail "the end of prismsim: exit code $?"
wait_for 5 field_is .state status connecting
sent=$(sed -n 's/.*: \([0-9]*\) simulated frames.*bytes lost to a slow reader.*/\1/p' "$dir/sim.err")
read -r came lost by_arrival <<<"$(prismctl --json line | jq -r '"\(.decoder.frames) \(.timing.missing_frames) \(.timing.missing_by_arrival)"')"
[ "$lost" -gt 4000 ] || fail "in a stall of 5 s: found $lost of $sent frames missing, expected most of 5000"
unknown=$((sent - came - lost))  # while the line was opened and closed; a turn of the counter would be 128
[ "$unknown" -ge 0 ] && [ "$unknown" -le 20 ] || fail "$came frames came, $lost are missing: expected $sent together"
[ "$by_arrival" -gt 3500 ] && [ "$by_arrival" -le "$lost" ] || fail "by arrival: found $by_arrival of $lost"
contains "events" "$(prismctl --json events)" '"frames_lost"'
