# SPDX-License-Identifier: MIT
# One client, one gyro or an unauthenticated connection must not disturb other clients of prismweb: large responses to many requests at
# once, a prismd that does not respond, connections without a token. Background: prismd closed the only connection
# of prismweb each time an hour of three axes was requested at once, so that this gyro was never served.
. "$(dirname "$0")/lib.sh"
needs_websockets
sed 's/^\( *"rate_hz": \)[0-9.]*/\110/' "$PRISM_SOURCE/config/frames/stim300.json" >three.json
echo "{\"frames\": \"$dir/three.json\", \"clock\": \"device\", \"accept_clock\": true, \"line\": {\"device\": \"$dir/tty\"}, \"log\": {\"directory\": \"$dir/log\"},
  \"socket\": {\"path\": \"$PRISM_SOCKET\", \"client_buffer_kib\": 16}, \"axes\": {\"x\": {}, \"y\": {}, \"z\": {}}, \"site\": {\"latitude_deg\": 34}}" >gyro.json
start sim prismsim --link tty --frames three.json --axis x,y,z --profile steady --speed 300
wait_for 5 test -e tty
start_prismd
start_web
cat >closed.py <<'END'
import asyncio, sys, websockets
from websockets.legacy.client import connect

async def closed(socket, message=None):
    """Sends the message, and returns the code and the reason with which the server closes the connection."""
    if message is not None:
        await socket.send(message)
    try:
        while True:
            await asyncio.wait_for(socket.recv(), 60)
    except websockets.ConnectionClosed as end:
        return f"{end.rcvd.code if end.rcvd else 1006} {end.rcvd.reason if end.rcvd else ''}"

async def silent(url):
    print(await closed(await connect(url)))

if __name__ == "__main__":
    asyncio.run(silent(sys.argv[1]))
END
start silent "$python" closed.py "ws${url#http}ws"  # is closed after 10 s
silent=$pid
enough() { [ "$(field .log.rows status)" -gt 1200 ]; }  # about 200 kB per response: more than prismd queues, 4 × 16 KiB
wait_for 20 enough
api() { curl -s --max-time 60 -H "Authorization: Bearer $token" "${url}$1"; }
state() { api api/instances | jq -r '.[0].state'; }
running() { [ "$(state)" = running ]; }
wait_for 5 running
cat >watch.py <<'END'
import asyncio, json, sys, websockets
from websockets.legacy.client import connect

async def main(url, token):
    """One client sends eight requests with large responses at once, another one only listens. Prints the number of responses, and the
    methods of the notifications to the other client."""
    ready = json.dumps({"token": token})
    async with connect(url, max_size=None) as greedy, connect(url) as other:
        for socket in greedy, other:
            await socket.send(ready)
            await socket.recv()
        for i in range(8):
            await greedy.send(json.dumps({"jsonrpc": "2.0", "id": i, "protocol": 2, "instance": "gyro", "method": "history", "params": {"seconds": 3600, "axis": "xyz"[i % 3]}}))
        answers = 0
        while answers < 8:
            message = json.loads(await asyncio.wait_for(greedy.recv(), 60))
            answers += "result" in message
            assert "error" not in message, message
        received = []
        try:
            while True:
                received.append(json.loads(await asyncio.wait_for(other.recv(), 1)).get("method"))
        except asyncio.TimeoutError:
            pass
        print(answers, received)

asyncio.run(main(*sys.argv[1:]))
END
same "eight large responses, and notifications to the other client" "$("$python" watch.py "ws${url#http}ws" "$token")" "8 []"
same "state after them" "$(state)" running
for axis in x y z; do
  same "seconds of $axis in memory" "$(api "api/gyro/range?axis=$axis&seconds=300&points=5000" | jq '.rows | length >= 250')" true
done
# A view that begins before all data has the seconds in memory, too.
same "the last hour" "$(api "api/gyro/range?axis=x&seconds=3600&points=5000" | jq -c '[.source, .step_s, (.rows | length > 300)]')" '["seconds",1,true]'

# A prismd that does not respond must not delay the metrics of the others: a scraper times out after 10 s.
kill -STOP "$prismd"
contains "/metrics" "$(api metrics)" 'prism_up{gyro="gyro"} 0'
same "state after /metrics: no request has timed out" "$(state)" running
kill -CONT "$prismd"

wait "$silent"
same "a client that sends no token" "$(cat silent.out)" "1008 no token received in 10 s"

# Unauthenticated connections in all slots are closed to admit a client with the token.
cat >strangers.py <<'END'
import socket, sys, time

port = int(sys.argv[1])
held = []
for i in range(150):
    one = socket.create_connection(("127.0.0.1", port))
    one.sendall(b"GET / HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n")
    held.append(one)
print("held", flush=True)
time.sleep(600)
END
start strangers "$python" strangers.py "$(sed 's|.*:\([0-9]*\)/$|\1|' <<<"$url")"
wait_for 10 grep -q held strangers.out
for _ in 1 2 3; do wait_for 1 running; done
kill -9 "$pid"; wait "$pid" 2>/dev/null || true

# A rejected client gets a code and the reason. After 1008 (no valid token) the page does not retry, so 1013 (too many clients) must differ.
cat >told.py <<'END'
import asyncio, json, sys, websockets
from closed import closed
from websockets.legacy.client import connect

async def main(url, token):
    open_one = lambda: connect(url)
    hello, held = json.dumps({"token": token}), []
    print("wrong:", await closed(await open_one(), json.dumps({"token": "x"})))
    print("none:", await closed(await open_one(), json.dumps({"token": ""})))
    print("no object:", await closed(await open_one(), "7"))
    print("bytes:", await closed(await open_one(), hello.encode()))
    for _ in range(64):
        held.append(await open_one())
        await held[-1].send(hello)
        await held[-1].recv()
    for size in 64, 65:
        await held[0].send(json.dumps({"jsonrpc": "2.0", "id": size * "a", "method": "instances"}))
        print("an id of", size, sorted(json.loads(await held[0].recv()))[0])
    print("one more:", await closed(await open_one(), hello))
    await held.pop().close()
    ready = False
    while not ready:  # prismweb notices the end of the connection
        last = await open_one()
        await last.send(hello)
        try:
            ready = json.loads(await last.recv())["ready"]
        except websockets.ConnectionClosed:
            pass
    print("when one went: ready", ready)
    await asyncio.gather(*(one.close() for one in [*held, last]))  # the end of the loop would wait 10 s for them

asyncio.run(main(*sys.argv[1:]))
END
same "codes and reasons of rejected clients" "$("$python" told.py "ws${url#http}ws" "$token" 2>&1)" 'wrong: 1008 wrong token
none: 1008 found no token
no object: 1008 expected {"token": "…"} first
bytes: 1003 found binary data, expected text
an id of 64 id
an id of 65 error
one more: 1013 64 clients are connected; retry later
when one went: ready True'

kill -TERM "$web"; wait "$web" || fail "exit code $?"

# A socket file with an invalid instance name is ignored with one line, and /metrics stays valid for the others.
mkdir -p prismd
touch prismd/$'bad\xff.sock' prismd/$'bad\nline.sock' prismd/fine.sock
echo '{"listen": "127.0.0.1:0", "state": ""}' >all.json
start names prismweb --config all.json
wait_for 5 grep -q token= names.out
url=$(sed 's/#.*//' names.out) token=$(program_token names.out)
sleep 1  # several searches
same "instances" "$(api api/instances | jq -c '[.[].name] | map(select(test("bad|fine")))')" '["fine"]'
api metrics | iconv -f utf-8 -t utf-8 >/dev/null || fail "/metrics is invalid UTF-8"
if command -v promtool >/dev/null; then same "promtool on /metrics" "$(api metrics | promtool check metrics 2>&1)" ""; fi
same "messages about invalid names" "$(grep -c 'ignored: .*bad' names.err)" 2
