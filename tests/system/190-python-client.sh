# SPDX-License-Identifier: MIT
# The Python client with a real prismd: requests, errors, and rows across a restart and a lost connection. A client of version 0.2, which
# sends no "protocol", gets one sentence.
. "$(dirname "$0")/lib.sh"
command -v python3 >/dev/null || skip "no python3"
export PYTHONDONTWRITEBYTECODE=1
config
start_sim --profile steady --speed 10
start_prismd
wait_for 10 field_above '.log.rows - .log.unsynced' status 20

export PYTHONPATH=$PRISM_SOURCE/clients/python
python3 - <<'END' || fail "requests"
import prism
with prism.Gyro() as gyro:
    assert gyro.status()["state"] == "receiving"
    assert gyro.bias()["quality"] == gyro.status()["quality"] and gyro.status()["log"]["rows"] >= 20
    assert gyro.stability()["axis"] == gyro.stability("z")["axis"] == "z" and gyro.ask("version")["protocol"] == 2
    history = gyro.history(5)
    assert len(history) == 5 and isinstance(history[0], prism.Window) and history[0].axis == "z", history
    assert gyro.history(5, axis="z")[0].axis == gyro.bias("z")["axis"] == "z"
    assert [row.time_s for row in history] == sorted(row.time_s for row in history)
    for method, params, code in (("nope", {}, -32601), ("history", {"seconds": 0}, -32602)):
        try:
            gyro.ask(method, **params)
            raise SystemExit(f"{method}: no error")
        except prism.Refused as why:
            assert why.code == code, why
    sample = next(gyro.samples(every=10))
    assert sample.rate_deg_per_h is not None and sample.quality, sample
try:
    prism.Gyro(path="/nowhere/x.sock").status()
    raise SystemExit("no error for a socket that does not exist")
except prism.Gone as why:
    assert str(why) == "/nowhere/x.sock: no prismd answers: No such file or directory", why
END

# Reading the log page by page continues after the last page, from its cursor.
python3 - <<'END' || fail "the log"
import prism
gyro = prism.Gyro()
pages = list(gyro.log())
seconds = [row["time_s"] for page in pages for row in page.rows]
assert len(seconds) >= 20 and seconds == [seconds[0] + i for i in range(len(seconds))], seconds
first = pages[0].rows[0]
assert (first["segment"], first["row"]) == (1, 1) and isinstance(first["rate_deg_per_h"], float), first
assert first["bias_deg_per_h"] is None and first["quality"] == "warming" and first["arrival_s"] > 1.7e9, first
follower = gyro.log(after=pages[-1].cursor, follow=True)
assert next(follower).rows[0]["time_s"] == seconds[-1] + 1
try:
    next(gyro.log(after="0" * 32 + "-1-1-1"))
    raise SystemExit("no error for a cursor of another log")
except prism.Refused as why:
    assert why.code == -32002 and "log 00000000" in str(why), why
END

# Methods with results by axis refuse a client of 0.2; the others have the same form.
older() { printf '{"jsonrpc":"2.0","id":1,"method":"%s"}\n' "$1" | timeout 5 socat -t 2 - "UNIX-CONNECT:$PRISM_SOCKET" | head -1 | jq -c "$2"; }
for method in status bias stability model config history rows; do
  same "$method for a client of 0.2" "$(older $method '[.error.code, .error.message]')" \
    '[-32600,"expected \"protocol\": 2 in the request: this client is older than prism 0.3; upgrade it"]'
done
same "version for a client of 0.2" "$(older version .result.name)" '"prismd"'
same "subscribe for a client of 0.2" "$(older subscribe .result.window)" true

# No second is missing or duplicate if the connection is lost while prismd keeps running.
python3 - <<'END' || fail "rows across a lost connection"
import socket, time
import prism
from prism import gyro as module
opened = []
class Counted(module.Connection):
    def __init__(self, path):
        super().__init__(path)
        opened.append(self)
module.Connection = Counted
times = []
for row in prism.Gyro().rows():
    times.append(row.time_s)
    if len(times) == 5:
        opened[-1]._link.shutdown(socket.SHUT_RDWR)
    if len(times) == 40:
        break
assert len(opened) == 2, opened
assert times == [times[0] + i for i in range(40)], times
END

# The client waits until a killed prismd is started again; the next request opens a new connection.
cat >"$dir/restart.py" <<'END'
import sys
import prism
gyro = prism.Gyro()
print(gyro.status()["started_s"], flush=True)
rows = gyro.rows()
next(rows)
print("row", flush=True)
sys.stdin.readline()
next(rows)
print(gyro.status()["started_s"], flush=True)
END
mkfifo "$dir/go"
start client sh -c "python3 '$dir/restart.py' <'$dir/go'"
exec 3>"$dir/go"
wait_for 5 grep -q row "$dir/client.out"
kill -9 "$prismd"; wait "$prismd" 2>/dev/null || true
start_prismd
echo >&3
three_lines() { [ "$(wc -l <"$dir/client.out")" -eq 3 ]; }
wait_for 10 three_lines
[ "$(head -1 "$dir/client.out")" != "$(tail -1 "$dir/client.out")" ] || fail "the response is from the killed prismd"

# A prismd without a free connection rejects the client; rows() tries again.
python3 - "$dir/full.sock" <<'END' || fail "a rejected connection"
import socket, sys, threading
import prism
server = socket.socket(socket.AF_UNIX)
server.bind(sys.argv[1])
server.listen()
def serve():
    for _ in range(2):
        client, _ = server.accept()
        client.sendall(b'{"jsonrpc":"2.0","id":null,"error":{"code":-32004,"message":"64 clients are connected"}}\n')
        client.recv(4096)
        client.close()
threading.Thread(target=serve, daemon=True).start()
try:
    prism.Gyro(path=sys.argv[1]).status()
    raise SystemExit("no error")
except prism.Gone as why:
    assert "64 clients are connected" in str(why), why
try:
    next(prism.Gyro(path=sys.argv[1]).rows(reconnect=False))
    raise SystemExit("no error")
except prism.Gone as why:
    assert "64 clients are connected" in str(why), why
END

# With reconnect=False the end of prismd raises an error.
start strict python3 -c '
import prism
for row in prism.Gyro().rows(reconnect=False):
    print(row.time_s, flush=True)'
wait_for 5 test -s "$dir/strict.out"
kill "$prismd"
wait_for 5 grep -q "prism._connection.Gone: .*prismd closed the connection" "$dir/strict.err"
