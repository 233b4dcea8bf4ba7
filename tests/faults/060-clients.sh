# SPDX-License-Identifier: MIT
# 250 clients request an hour of history and never read: prismd needs less than 64 MB and responds to other clients. Earlier: up to 555 MB.
. "$(dirname "$0")/lib.sh"
config
start_sim --profile steady --speed 300
start_prismd
wait_for 10 field_is .state status receiving
wait_for 10 field_above .log.rows status 2000  # a long history
python3 - "$PRISM_SOCKET" "$prismd" <<'END' || fail "see above"
import socket, sys, time
ask = b'{"jsonrpc":"2.0","id":1,"protocol":2,"method":"history","params":{"seconds":3600}}\n'
clients = []
for i in range(250):
    s = socket.socket(socket.AF_UNIX); s.connect(sys.argv[1]); s.setblocking(False); clients.append(s)
for _ in range(20):
    for s in clients:
        try: s.send(ask)
        except OSError: pass
    time.sleep(0.05)
time.sleep(2)
peak = [int(line.split()[1]) for line in open("/proc/%s/status" % sys.argv[2]) if line.startswith("VmHWM")][0]
print("peak resident memory: %d MB" % (peak // 1024))
assert peak < 64 * 1024, "expected less than 64 MB"
END
same "response to another client" "$(prismctl --json version | jq -r .name)" prismd
