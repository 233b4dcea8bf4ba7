# SPDX-License-Identifier: MIT
# 64 clients, one of which never reads: it costs the others nothing, loses rows by count and is told how many.
. "$(dirname "$0")/lib.sh"
config
start_sim --profile steady --speed 40
start_prismd
python3 - "$PRISM_SOCKET" <<'END' || fail "see above"
import json, socket, sys, threading, time
ask = b'{"jsonrpc":"2.0","id":1,"method":"subscribe","params":{"streams":["sample"]}}\n'
def client():
    s = socket.socket(socket.AF_UNIX); s.connect(sys.argv[1]); s.sendall(ask); return s
slow, fast = client(), [client() for _ in range(63)]
counts, losses, wanted, end = [0] * 63, [0], 10000, time.time() + 60
def read(i):
    rest = b""
    while counts[i] < wanted and time.time() < end:
        rest += fast[i].recv(1 << 20)
        lines = rest.split(b"\n"); rest = lines.pop()
        counts[i] += len(lines); losses[0] += sum(b'"lost"' in l for l in lines)
threads = [threading.Thread(target=read, args=(i,)) for i in range(63)]
[t.start() for t in threads]; [t.join() for t in threads]
assert min(counts) >= wanted, f"the others got few rows: {min(counts)} to {max(counts)}"
assert losses[0] == 0, f"{losses[0]} reading clients lost rows"
slow.settimeout(5); rest, told = b"", None
while told is None:
    rest += slow.recv(1 << 20)
    for line in rest.split(b"\n")[:-1]:
        message = json.loads(line)
        if message.get("method") == "lost": told = message["params"]["rows"]
    rest = rest.split(b"\n")[-1]
assert told > 1000, f"the slow client was told of {told} lost rows"
END
[ "$(field .clients.lost_rows status)" -gt 1000 ] || fail "lost rows in status: $(field .clients.lost_rows status)"
