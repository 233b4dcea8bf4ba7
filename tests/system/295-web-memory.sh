# SPDX-License-Identifier: MIT
# Clients that send requests and never read the responses: the memory of prismweb stays below the limits of docs/protocol.md and is returned
# after they leave. History: four such clients sent 1 089 000 requests, prismweb grew from 10.6 to 224 MB and stayed there.
. "$(dirname "$0")/lib.sh"
needs_websockets
frames 2
config
start_sim --profile fast --speed 1000
start_prismd
web_state=$dir/state
start_web
api() { curl -s --max-time 60 -H "Authorization: Bearer $token" "${url}api/gyro/$1"; }
long_enough() { [ "$(api 'history?seconds=3600' | jq '.axes.z | length')" = 3600 ]; }
wait_for 60 long_enough
kill -STOP "$sim"
cat >deaf.py <<'END_DEAF'
import base64, json, select, socket, struct, sys, threading, time

pid, url, token, how, seconds = int(sys.argv[1]), sys.argv[2], sys.argv[3], sys.argv[4], float(sys.argv[5])
host, port = url.split("/")[2].split(":")


def rss():
    """MiB"""
    for line in open(f"/proc/{pid}/status"):
        if line.startswith("VmRSS"):
            return int(line.split()[1]) / 1024


def small():
    client = socket.socket()
    client.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
    client.connect((host, int(port)))
    return client


def frame(text):
    """A masked text frame; the mask is zero."""
    size = bytes([128 + len(text)]) if len(text) < 126 else bytes([254]) + struct.pack(">H", len(text))
    return b"\x81" + size + bytes(4) + text.encode()


def websocket():
    client = small()
    key = base64.b64encode(bytes(16)).decode()
    client.sendall(f"GET /ws HTTP/1.1\r\nHost: {host}:{port}\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
                   f"Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: {key}\r\n\r\n".encode() )
    assert b"101" in client.recv(12)
    client.sendall(frame(json.dumps({"token": token})))
    return client


def request(number):
    method, params = [("version", {}), ("nothing", {}), ("instances", {}), ("version", {}), ("status", {}), ("range", {"seconds": 7000, "points": 5000}),
                      ("history", {"seconds": 3600}), ("rows", {"after": "earliest", "limit": 10000})][number if how == "mixed" else 0]
    return json.dumps({"jsonrpc": "2.0", "id": 1, "protocol": 2, "instance": "gyro", "method": method, "params": params})


begin = most = rss()
until = time.monotonic() + seconds
sent = left = 0
clients = []
if how == "http":
    for i in range(110):
        clients.append(small())
        clients[-1].sendall(f"GET /api/gyro/history?seconds=3600 HTTP/1.1\r\nHost: {host}:{port}\r\nAuthorization: Bearer {token}\r\n\r\n".encode())
    sent = len(clients)
    while time.monotonic() < until:
        most = max(most, rss())
        time.sleep(0.02)
else:
    clients = [websocket() for _ in range(4)]
    text = b"".join(frame(request(i % 8)) for i in range(800))
    rest = {client: b"" for client in clients}
    for client in clients:
        client.setblocking(False)
    while time.monotonic() < until and rest:
        most = max(most, rss())
        for client in select.select([], list(rest), [], 0.05)[1]:
            try:
                rest[client] = rest[client] or text
                done = client.send(rest[client])
                sent += rest[client][:done].count(b"jsonrpc")
                rest[client] = rest[client][done:]
            except OSError:
                del rest[client]
                left += 1
for client in clients:
    client.close()
for _ in range(600):  # prismweb notices the end, and returns memory every second
    end = rss()
    if end < begin + 8:
        break
    time.sleep(0.1)
print(json.dumps({"sent": sent, "closed": left, "begin": round(begin, 1), "most": round(most, 1), "end": round(end, 1)}))
END_DEAF
# deaf HOW SECONDS MIB: the memory grows by at most MIB, and by at most 8 MiB in the end.
deaf() {
  "$python" deaf.py "$web" "$url" "$token" "$1" "$2" >deaf.out 2>&1 || fail "$(cat deaf.out)"
  echo "$1: $(cat deaf.out)"
  jq -e --argjson most "$3" '.most - .begin < $most and .end - .begin < 8' deaf.out >/dev/null || fail "$1: found $(cat deaf.out) MiB, expected growth by at most $3 MiB, in the end 8 MiB"
}
api 'range?seconds=7000&points=5000' >range.json  # the first large response also fills the caches of the store
deaf short 5 16
deaf mixed 7 32  # 4 MiB per client, and intermediate results
deaf http 4 144  # 128 MiB in total, and intermediate results
same "prismweb serves others" "$(api status | jq -r .state)" "$(field .state status)"
! grep -q "Traceback" deaf.out || fail "$(cat deaf.out)"
