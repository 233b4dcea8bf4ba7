# SPDX-License-Identifier: MIT
# HTTP requests that are ambiguous, too long or have unknown parameters are rejected with a status and one line. History: of two Host or
# Origin fields the first one counted, an unknown Transfer-Encoding was ignored, a long header cut the connection without a status, and
# a typing error in a parameter returned the default range.
. "$(dirname "$0")/lib.sh"
needs_websockets
config
start_sim --profile steady
start_prismd
start_web "\"page\": \"$PRISM_SOURCE/tools/prismweb/page\""
port=$(sed 's|.*:\([0-9]*\)/$|\1|' <<<"$url")
running() { [ "$(curl -s -H "Authorization: Bearer $token" "${url}api/instances" | jq -r '.[0].state')" = running ]; }
wait_for 5 running

# Each line: expected status, a part of the body, and the request; @H is a valid Host field, @A the token, LONG(n) n bytes.
cat >requests.txt <<'END_REQUESTS'
200|DOCTYPE|GET / HTTP/1.1\r\n@H\r\n
200|DOCTYPE|GET / HTTP/1.1\r\n@H\r\nContent-Length: 0\r\n\r\n
400|found 2 fields "Host", expected one|GET / HTTP/1.1\r\n@HHost: evil.example\r\n\r\n
400|found 2 fields "Host", expected one|GET / HTTP/1.1\r\nHost: evil.example\r\n@H\r\n
400|found 3 fields "Origin", expected one|GET / HTTP/1.1\r\n@HOrigin: http://localhost\r\nOrigin: http://localhost\r\nOrigin: http://evil.example\r\n\r\n
400|found 2 fields "Authorization", expected one|GET /api/instances HTTP/1.1\r\n@H@AAuthorization: Bearer x\r\n\r\n
400|found 2 fields "Cookie", expected one|GET / HTTP/1.1\r\n@HCookie: a=1\r\nCookie: b=1\r\n\r\n
400|found a body, expected none|GET / HTTP/1.1\r\n@HTransfer-Encoding: gzip\r\n\r\n
400|found a body, expected none|GET / HTTP/1.1\r\n@HTransfer-Encoding: chunked\r\n\r\n0\r\n\r\n
400|found a body, expected none|GET / HTTP/1.1\r\n@HTransfer-Encoding: chunked, identity\r\n\r\n
400|found a body, expected none|GET / HTTP/1.1\r\n@HContent-Length: 5\r\n\r\nhello
400|found a body, expected none|POST /session HTTP/1.1\r\n@HContent-Length: 3\r\n\r\na=1
400|found a body, expected none|GET / HTTP/1.1\r\n@HContent-Length: 100000000\r\n\r\n
400|invalid HTTP request: |GET / HTTP/1.1\r\n@HContent-Length: 1\r\nContent-Length: 2\r\n\r\n
400|invalid HTTP request: |GET / HTTP/1.1\r\n@HContent-Length: x\r\n\r\n
400|invalid HTTP request: |GET / HTTP/9.9\r\n@H\r\n
400|invalid HTTP request: |GET / HTTP/1.1\r\n@HX y: 1\r\n\r\n
400|invalid HTTP request: |G<T / HTTP/1.1\r\n@H\r\n
200|DOCTYPE|GET / HTTP/1.1\r\n@HX-Long: LONG(7900)\r\n\r\n
431|the header is too long, expected at most 8192 bytes|GET / HTTP/1.1\r\n@HX-Long: LONG(8300)\r\n\r\n
431|the header is too long, expected at most 8192 bytes|GET / HTTP/1.1\r\n@HX-Long: LONG(700000)\r\n\r\n
431|the header is too long, expected at most 8192 bytes|GET /LONG(9000) HTTP/1.1\r\n@H\r\n
431|the header is too long, expected at most 8192 bytes|GET / HTTP/1.1\r\n@HX-Long: LONG(9000)
400|range: found the parameter \"first_s\", expected only axis, from_s, to_s, seconds, points|GET /api/gyro/range?first_s=1 HTTP/1.1\r\n@H@A\r\n
400|found the parameter \"seconds\" twice, expected it once|GET /api/gyro/range?seconds=60&seconds=3600 HTTP/1.1\r\n@H@A\r\n
400|found the parameter \"axis\" twice, expected it once|GET /api/gyro/rows?axis=z&a%78is=z HTTP/1.1\r\n@H@A\r\n
400|rows: found the parameter \"wait_s\", expected only axis, after, limit, header|GET /api/gyro/rows?wait_s=9 HTTP/1.1\r\n@H@A\r\n
400|status: found the parameter \"x\", expected none|GET /api/gyro/status?x=1 HTTP/1.1\r\n@H@A\r\n
400|instances: found the parameter \"x\", expected none|GET /api/instances?x=1 HTTP/1.1\r\n@H@A\r\n
400|expected NAME=VALUE|GET /api/gyro/bias?=1 HTTP/1.1\r\n@H@A\r\n
200|step_s|GET /api/gyro/range?axis=z&from_s=1&to_s=9e9&points=10 HTTP/1.1\r\n@H@A\r\n
200|{"axes":{"z":{|GET /api/gyro/rows?axis=z&after=earliest&limit=5&header=true HTTP/1.1\r\n@H@A\r\n
200|{"axes":{"z":[|GET /api/gyro/history?axis=z&seconds=5 HTTP/1.1\r\n@H@A\r\n
200|[|GET /api/gyro/events?count=1 HTTP/1.1\r\n@H@A\r\n
404|no instance|GET /api/none/bias HTTP/1.1\r\n@H@A\r\n
END_REQUESTS
cat >send.py <<'END_SEND'
import re, socket, sys

port, token = int(sys.argv[1]), sys.argv[2]
wrong = 0
for line in open("requests.txt"):
    status, part, request = line.rstrip("\n").split("|", 2)
    full = request.replace("@H", f"Host: 127.0.0.1:{port}\\r\\n").replace("@A", f"Authorization: Bearer {token}\\r\\n").replace("\\r\\n", "\r\n")
    full = re.sub(r"LONG\((\d+)\)", lambda found: int(found[1]) * "x", full)
    with socket.create_connection(("127.0.0.1", port), timeout=3) as client:
        client.sendall(full.encode())
        answer = b""
        # A rejected connection ends after the response; the others stay open, with a body of the given length.
        while not re.search(rb"\r\n\r\n", answer) or len(answer.split(b"\r\n\r\n", 1)[1]) < int(re.search(rb"Content-Length: (\d+)", answer)[1]):
            more = client.recv(65536)
            if not more:
                break
            answer += more
        head, _, body = answer.partition(b"\r\n\r\n")
        closed = int(status) in (400, 431) and b"/api/" not in full.encode() or b"Connection: close" in head
        try:
            end = client.recv(100) if closed else b""
        except TimeoutError:
            end = b"still open"
    if not head.startswith(b"HTTP/1.1 " + status.encode()) or part.encode() not in body or end != b"":
        print(f"{request}: found {head.splitlines()[:1]} {body[:200]} {end}, expected {status} {part}")
        wrong += 1
    if status != "200" and body.count(b"\n") != 1:
        print(f"{request}: found {body}, expected one line")
        wrong += 1
sys.exit(wrong > 0)
END_SEND
"$python" send.py "$port" "$token" >send.out 2>&1 || fail "$(cat send.out)"

# The WebSocket's methods reject unknown params with the same list.
client() { "$python" "$PRISM_SOURCE/tests/system/web_client.py" "ws://127.0.0.1:$port/ws" "$token" "$@"; }
wrong_params() { client ask "$1" "$2" | jq -c '[.error.code, .error.message]'; }
same "range" "$(wrong_params range '{"first_s": 1}')" '[-32602,"range: found the parameter \"first_s\", expected only axis, from_s, to_s, seconds, points"]'
same "version" "$(wrong_params version '{"axis": "z"}')" '[-32602,"version: found the parameter \"axis\", expected none"]'
same "rows" "$(wrong_params rows '{"name": "x"}')" '[-32602,"rows: found the parameter \"name\", expected only axis, after, limit, header"]'
contains "subscribe" "$(wrong_params subscribe '{"stream": ["sample"]}')" 'expected {\"streams\": [\"sample\", \"window\", \"event\"], \"every\": 1 to 1000000, \"axes\": [NAME, …]}'
same "rows with its params" "$(client ask rows '{"after": "earliest", "limit": 1, "axis": "z"}' | jq 'has("result")')" true

# Of 80 instances, each is sent every second: when one was sent every 50 ms, a message had four seconds, and the page showed no data.
mkdir many
for i in $(seq 80); do ln -s "$PRISM_SOCKET" "many/gyro$i.sock"; done
echo "{\"listen\": \"127.0.0.1:0\", \"instances\": \"$dir/many/\", \"state\": \"\"}" >many.json
start many prismweb --config many.json
wait_for 5 grep -q token= many.out
url=$(sed 's/#.*//' many.out) token=$(program_token many.out)
all_run() { [ "$(curl -s -H "Authorization: Bearer $token" "${url}api/instances" | jq 'map(select(.state == "running")) | length')" = 80 ]; }
wait_for 20 all_run
cat >many.py <<'END'
import asyncio, json, sys
from websockets.legacy.client import connect

async def main(url, token):
    async with connect(url, max_size=None) as socket:
        await socket.send(json.dumps({"token": token}))
        for i in range(80):
            await socket.send(json.dumps({"jsonrpc": "2.0", "id": i, "protocol": 2, "instance": f"gyro{i + 1}", "method": "subscribe", "params": {"streams": ["window"]}}))
        batches = []
        while len(batches) < 400:
            message = json.loads(await asyncio.wait_for(socket.recv(), 60))
            batches += [len(message["batch"])] if "batch" in message else []
        print(sum(batches[200:]) / 200)

asyncio.run(main(*sys.argv[1:]))
END
same "at most two seconds in a message" "$("$python" many.py "ws${url#http}ws" "$token" | jq '. < 2')" true
