# SPDX-License-Identifier: MIT
# One user opens three quarters of the connections: the next one is rejected with an error, other users still connect, and root
# connects even if all connections are in use. A client that is idle for a minute is disconnected to admit a new one, a
# subscriber is not.
. "$(dirname "$0")/lib.sh"
[ "$(id -u)" -eq 0 ] || skip "needs root, to connect as several users"
chmod 711 "$dir"
export PRISM_TIME_SCALE=5  # 12 s: longer than the first part takes
config
sed -i 's|"socket": {|"socket": {"mode": "0666", "max_clients": 8, |' "$dir/gyro.json"
start_sim --profile steady --speed 1
start_prismd
wait_for 10 field_is .state status receiving
only_this() { field_is .clients.connected status 1; }
wait_for 5 only_this
python3 - "$PRISM_SOCKET" $((60 / PRISM_TIME_SCALE)) <<'END' || fail "see above"
import json, os, socket, sys, time
ASK = b'{"jsonrpc":"2.0","id":1,"method":"version"}\n'
LISTEN = b'{"jsonrpc":"2.0","id":1,"method":"subscribe","params":{"streams":["window"]}}\n'

def come(user, first=ASK):
    """Connects as `user`; returns the socket and the first line received."""
    os.seteuid(user)
    try:
        s = socket.socket(socket.AF_UNIX)
        s.settimeout(60)
        s.connect(sys.argv[1])
        s.sendall(first)
    except BrokenPipeError:
        pass  # rejected before the request was sent; the error can still be read
    finally:
        os.seteuid(0)
    data = b""
    while not data.endswith(b"\n"):
        more = s.recv(4096)
        if not more: break
        data += more
    return s, data

def served(answer): return b'"result"' in answer
def gone(s):
    s.settimeout(1.5)
    end = time.monotonic() + 1.5
    try:
        while time.monotonic() < end:
            if not s.recv(4096): return True
    except socket.timeout:
        pass
    return False

def refused(answer, words):
    assert not served(answer) and words in answer, "found %r, expected an error with %r" % (answer, words)

greedy = [come(1001, LISTEN if i < 2 else ASK) for i in range(6)]
assert all(served(answer) for _, answer in greedy), greedy
refused(come(1001)[1], b"6 clients of this user are connected")
others = [come(1002) for _ in range(2)]
assert all(served(answer) for _, answer in others), others
refused(come(1003)[1], b"8 clients are connected")
root, answer = come(0)
assert served(answer), answer
assert gone(others[1][0]), "root connected, but no client was disconnected"
assert not gone(greedy[0][0]) and not gone(others[0][0]), "more than one client was disconnected for root"
refused(come(1003)[1], b"8 clients are connected")
time.sleep(int(sys.argv[2]) + 0.5)
stranger, answer = come(1003)
assert served(answer), "after a minute: found %r, expected a result" % answer
silent = [gone(s) for s, _ in greedy[:2]]
assert silent == [False, False], "a subscriber was disconnected"
END
