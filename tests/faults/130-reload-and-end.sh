# SPDX-License-Identifier: MIT
# SIGTERM during a reload, PRISM_ENDS times (20; long form: 1000), with random pauses between the signals: prismd always ends with exit
# code 0. With tools/check --asan and --tsan this finds a use after free. History: 36 of 150 runs read freed memory.
. "$(dirname "$0")/lib.sh"
config
start_sim --profile steady --speed 1
python3 - "$dir" "${PRISM_ENDS:-$(long 20 1000)}" <<'END' || fail "see above"
import os, random, signal, socket, subprocess, sys, time
folder, times = sys.argv[1], int(sys.argv[2])
path = os.environ["PRISM_SOCKET"]

def answers(daemon):
    end = time.monotonic() + 100
    while time.monotonic() < end and daemon.poll() is None:
        with socket.socket(socket.AF_UNIX) as s:
            s.settimeout(60)
            try:
                s.connect(path)
                s.sendall(b'{"jsonrpc":"2.0","id":1,"method":"version"}\n')
                if b"result" in s.recv(4096): return True
            except OSError: pass
        time.sleep(0.002)
    return False

for i in range(times):
    with open(folder + "/prismd.err", "w") as err:
        daemon = subprocess.Popen(["prismd", folder + "/gyro.json"], stderr=err, stdout=err)
    assert answers(daemon), "start %d: no response" % i
    for _ in range(random.choice([1, 1, 3])):
        daemon.send_signal(signal.SIGHUP)
        time.sleep(random.choice([0, 0, 0.0005, 0.002, 0.01]))
    daemon.send_signal(signal.SIGTERM)
    code = daemon.wait(100)
    assert code == 0, "end %d: found exit code %d, expected 0" % (i, code)
END
