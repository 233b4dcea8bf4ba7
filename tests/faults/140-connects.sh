# SPDX-License-Identifier: MIT
# During 1 000 connects (long form: 10 000), with 240 idle clients and 4 subscribers that never read, a subscriber that reads receives
# every sample.
. "$(dirname "$0")/lib.sh"
config
start_sim --profile steady --speed 1
start_prismd
wait_for 10 field_is .state status receiving
python3 - "$PRISM_SOCKET" "$(long 1000 10000)" <<'END' || fail "see above"
import json, socket, sys, threading, time
def connect(ask=None):
    s = socket.socket(socket.AF_UNIX)
    s.connect(sys.argv[1])
    if ask: s.sendall(ask)
    return s
SAMPLES = b'{"jsonrpc":"2.0","id":1,"method":"subscribe","params":{"streams":["sample"]}}\n'
reader = connect(SAMPLES)
reader.settimeout(60)
lines, stop = [], threading.Event()
def read():
    data = b""
    while not stop.is_set():
        data += reader.recv(1 << 20)
        *whole, data = data.split(b"\n")
        lines.extend(whole)
thread = threading.Thread(target=read)
thread.start()
deaf = [connect(SAMPLES) for _ in range(4)]
idle = [connect() for _ in range(240)]
for i in range(int(sys.argv[2])):
    s = connect(b'{"jsonrpc":"2.0","id":1,"method":"version"}\n' if i % 2 else None)
    if i % 4 == 1: s.recv(1 << 16)
    s.close()
end = time.monotonic() + 100
while len(lines) < 500 and time.monotonic() < end: time.sleep(0.1)
stop.set()
thread.join()
told = [json.loads(line) for line in lines]
assert not any(message.get("method") == "lost" for message in told), "the reading subscriber lost rows"
times = [message["params"]["time_ns"] if "time_ns" in message["params"] else message["params"]["time_s"]
         for message in told if message.get("method") == "sample"]
steps = {round((b - a) * 1e3) for a, b in zip(times, times[1:])}
print(len(times), "samples during", sys.argv[2], "connects, steps of", sorted(steps), "ms")
assert len(times) > 400 and steps == {5}, "expected more than 400 samples, one every 5 ms"
END
same "frames lost" "$(field .timing.missing_frames status)" 0
