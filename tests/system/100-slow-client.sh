# SPDX-License-Identifier: MIT
# 64 clients, one of which does not read at first: only this one loses rows, and gets their number.
. "$(dirname "$0")/lib.sh"
config
sed -i 's/"socket": {/"socket": {"client_buffer_kib": 512, /' "$dir/gyro.json"
start_sim --profile steady  # 3 MB/s for 63 readers: one may pause for 10 s before its queue is full
start_prismd
python3 - "$PRISM_SOCKET" <<'END' || fail "see above"
import json, selectors, socket, sys, time
ask = b'{"jsonrpc":"2.0","id":1,"method":"subscribe","params":{"streams":["sample"]}}\n'
def client():
    s = socket.socket(socket.AF_UNIX); s.connect(sys.argv[1]); s.sendall(ask); return s
slow, fast = client(), [client() for _ in range(63)]
counts, losses, wanted, end = dict.fromkeys(fast, 0), 0, 5000, time.time() + 200
poll = selectors.DefaultSelector()
for s in fast: poll.register(s, selectors.EVENT_READ)
while min(counts.values()) < wanted and time.time() < end:
    for key, _ in poll.select(1):
        data = key.fileobj.recv(1 << 20)
        counts[key.fileobj] += data.count(b"\n"); losses += data.count(b'"lost"')
counts = list(counts.values())
assert min(counts) >= wanted, f"the other clients got too few rows: {min(counts)} to {max(counts)}"
assert losses == 0, f"reading clients lost rows {losses} times"
slow.settimeout(60); rest, lost = b"", None
while lost is None:
    assert time.time() < end + 20, "the slow client got no report of lost rows"
    rest += slow.recv(1 << 20)
    for line in rest.split(b"\n")[:-1]:
        message = json.loads(line)
        if message.get("method") == "lost": lost = message["params"]["rows"]
    rest = rest.split(b"\n")[-1]
assert lost > 1000, f"the slow client got a report of {lost} lost rows, expected more than 1000"
END
[ "$(field .clients.lost_rows status)" -gt 1000 ] || fail "lost rows in status: $(field .clients.lost_rows status)"
