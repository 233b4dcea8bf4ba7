# SPDX-License-Identifier: MIT
# PRISM_KILLS times kill -9 (6; long form: 500), each at a random moment. The log contains every row that a subscriber received and
# has no damage except truncated segments.
. "$(dirname "$0")/lib.sh"
kills=${PRISM_KILLS:-$(long 6 500)}
frames 20
config
start_sim --profile second --speed 20

python3 - "$kills" prismd "$dir/gyro.json" "$PRISM_SOCKET" "$dir/log" <<'END' || fail "see above"
import glob, json, os, random, signal, socket, subprocess, sys, time
kills, program, config, path, log = int(sys.argv[1]), *sys.argv[2:6]
random.seed(1)

def connect(deadline):
    while True:
        s = socket.socket(socket.AF_UNIX)
        try: s.connect(path); return s
        except OSError:
            s.close()
            if time.monotonic() > deadline: sys.exit("prismd does not respond")
            time.sleep(0.01)

def seconds(name):
    with open(name, "rb") as file: text = file.read().decode()
    return {int(line.split(",")[1]) for line in text[: text.rfind("\n") + 1].split("\n") if line[:1].isdigit()}

told_in_all = 0
for kill in range(kills):
    before = set(glob.glob(log + "/*.csv"))
    daemon = subprocess.Popen([program, config], stderr=subprocess.DEVNULL)
    s = connect(time.monotonic() + 100)
    s.sendall(b'{"jsonrpc":"2.0","id":1,"method":"subscribe","params":{"streams":["window"]}}\n')
    s.settimeout(0.05)
    data, arrived, end, limit = b"", [], None, time.monotonic() + 100
    while end is None or time.monotonic() < end:
        try: data += s.recv(1 << 16)
        except socket.timeout: pass
        arrived += [time.monotonic()] * (data.count(b"\n") - len(arrived))
        if end is None and data.count(b"\n") > 2: end = time.monotonic() + random.random() * 0.7
        if time.monotonic() > limit: sys.exit("no row for 100 s")
    killed = time.monotonic()
    daemon.send_signal(signal.SIGKILL)
    daemon.wait()
    try:  # reads the rest that prismd sent before the kill
        while True:
            more = s.recv(1 << 16)
            if not more: break
            data += more
    except OSError: pass
    arrived += [killed] * (data.count(b"\n") - len(arrived))
    lines = [(json.loads(line), at) for line, at in zip(data.split(b"\n"), arrived)]
    when = {int(line["params"]["time_s"]): at for line, at in lines if line.get("method") == "window"}
    told = list(when)
    there = set().union(*(seconds(name) for name in set(glob.glob(log + "/*.csv")) - before))
    lost = [second for second in told if second not in there]
    told_in_all += len(told)
    if lost:
        ago_ms = [round(1000 * (killed - when[second])) for second in lost]
        sys.exit("kill %d: received %s; not in the log: %s, received %s ms before" % (kill + 1, told, lost, ago_ms))
print("%d kills: %d rows received, 0 lost" % (kills, told_in_all))
END
code=0; prismcal verify "$dir/log" --json >"$dir/verify.json" || code=$?
same "exit code of verify after kills" "$code" 1
same "faults except truncated segments" "$(jq -c '[.findings[] | select(.fault and .state != "torn")]' "$dir/verify.json")" "[]"
