# SPDX-License-Identifier: MIT
# The matrix of lines and faults: tty, TCP (connect and listen) and UDP, each clean, with a peer that closes, vanishes, stalls for 6 s,
# refuses, has no name yet, and is half open after a suspend; for a gyro and a polled sensor line at once.
. "$(dirname "$0")/lib.sh"
command -v python3 >/dev/null && command -v ip >/dev/null && command -v ss >/dev/null || skip "no python3 or iproute2 (tools/setup all)"
unshare --net --mount true 2>/dev/null || skip "needs root to make network namespaces"
frames 50
# SIGTERM ends prismd within 5 s while the name server does not answer.
cat >"$dir/dead.py" <<'END'
import socket, subprocess
server = socket.socket(type=socket.SOCK_DGRAM)
server.bind(("127.0.0.1", 53))
prismd = subprocess.Popen(["prismd", "gyro.json"])
try:
    server.recv(999)
    prismd.terminate()
    assert prismd.wait(5) == 0
finally:
    prismd.kill()
END
printf 'nameserver 127.0.0.1\noptions timeout:30\n' >"$dir/resolv.conf"
echo '{"line": {"tcp": {"address": "gyro.test:4001"}}, "frames": "frames.json"}' >"$dir/gyro.json"
unshare --net --mount sh -c 'mount --bind resolv.conf /etc/resolv.conf && ip link set lo up && exec python3 dead.py' || fail "a dead name server"
prismsim --frames "$dir/frames.json" --profile steady --hours 0.05 --out "$dir/c.pcap" 2>/dev/null
cp /etc/hosts "$dir/hosts"
[ $# -gt 0 ] || set -- tty connect listen udp
workers=()
for type in "$@"; do
  unshare --net --mount sh -c 'mount --bind "$1/hosts" /etc/hosts && shift && exec "$@"' sh "$dir" \
    python3 "$PRISM_SOURCE/tests/system/network_faults.py" "$dir" "$dir/c.pcap" "$dir/frames.json" "$type" &
  workers+=("$!"); children+=("$!")
done
code=0
for worker in "${workers[@]}"; do wait "$worker" || code=1; done
[ "$code" = 0 ] || fail "see above"
