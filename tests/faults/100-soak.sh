# SPDX-License-Identifier: MIT
# PRISM_SOAK_S seconds of data (10; long form: 1200) live at 2 kHz with 20 clients that subscribe to every window and every tenth sample: no
# frame is rejected or missing, no client loses a row, all receive the same windows, memory and descriptors do not grow.
. "$(dirname "$0")/lib.sh"
seconds=${PRISM_SOAK_S:-$(long 10 1200)}
frames 2000
config
start_sim --profile second --speed 1
start_prismd
wait_for 10 field_is .state status receiving

python3 - "$PRISM_SOCKET" "$prismd" "$seconds" <<'END' || fail "see above"
import collections, json, os, select, socket, sys, time
path, pid, seconds = sys.argv[1], sys.argv[2], float(sys.argv[3])

def memory_kb():
    return next(int(line.split()[1]) for line in open("/proc/%s/status" % pid) if line.startswith("VmRSS"))

clients, data, kinds, windows = [], {}, collections.Counter(), {}
for _ in range(20):
    s = socket.socket(socket.AF_UNIX); s.connect(path)
    s.sendall(b'{"jsonrpc":"2.0","id":1,"method":"subscribe","params":{"streams":["window","sample","event"],"every":10}}\n')
    s.setblocking(False); clients.append(s); data[s] = b""; windows[s] = []
end, warm_kb = time.monotonic() + 2 * seconds + 120, None
while min(map(len, windows.values())) < seconds:
    if time.monotonic() > end: sys.exit("windows: %s of %g" % (sorted(map(len, windows.values())), seconds))
    for s in select.select(clients, [], [], 1)[0]:
        more = s.recv(1 << 18)
        if not more: sys.exit("prismd closed a client")
        *lines, data[s] = (data[s] + more).split(b"\n")
        for line in lines:
            kind = line[:40].split(b'"method":"')[-1].split(b'"')[0]
            kinds[kind] += 1
            if kind == b"window": windows[s].append(json.loads(line)["params"]["time_s"])
            if kind not in (b"window", b"sample", b"event") and b'"result"' not in line: sys.exit("received %r" % line)
    if warm_kb is None and len(windows[clients[0]]) > seconds / 4: warm_kb, warm_fds = memory_kb(), len(os.listdir("/proc/%s/fd" % pid))
end_kb, end_fds = memory_kb(), len(os.listdir("/proc/%s/fd" % pid))
heard = [windows[s] for s in clients]
common = set.intersection(*map(set, heard))
print("%s; %d kB, then %d kB" % ({k.decode(): v for k, v in kinds.items()}, warm_kb, end_kb))
for seen in heard:
    first, last = min(common), max(common)
    if [t for t in seen if first <= t <= last] != list(range(int(first), int(last) + 1)): sys.exit("a client received %s" % seen)
if end_kb > warm_kb + 2048 + seconds: sys.exit("memory grew from %d to %d kB" % (warm_kb, end_kb))
if end_fds > warm_fds: sys.exit("descriptors grew from %d to %d" % (warm_fds, end_fds))
END
same "frames rejected, bytes skipped, frames missing" \
  "$(field '[.line.bad_check, .line.bad_length, .line.bad_body, .line.skipped_bytes, .timing.missing_frames] | tojson' status)" "[0,0,0,0,0]"
same "rows lost by clients, rows dropped by the log" "$(field '[.clients.lost_rows, .log.dropped] | tojson' status)" "[0,0]"
same "sessions" "$(field .sessions status)" 1
kill -TERM "$prismd"; wait "$prismd" || fail "exit code $?"
prismcal verify "$dir/log" >"$dir/verify" || fail "the log: $(cat "$dir/verify")"
