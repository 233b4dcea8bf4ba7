# SPDX-License-Identifier: MIT
# The protocol of systemd without systemd: READY, STATUS, WATCHDOG, RELOADING, STOPPING, and a socket passed to prismd.
. "$(dirname "$0")/lib.sh"
frames 50
config
start_sim --profile steady --speed 1
python3 - "$dir" <<'END' || fail "see above"
import os, signal, socket, subprocess, sys, time
folder = sys.argv[1]
notify = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM); notify.bind(folder + "/notify"); notify.settimeout(60)
listener = socket.socket(socket.AF_UNIX); listener.bind(folder + "/handed.sock"); listener.listen()
def child():
    os.dup2(listener.fileno(), 3); os.set_inheritable(3, True)
    os.environ.update(LISTEN_FDS="1", LISTEN_PID=str(os.getpid()), NOTIFY_SOCKET=folder + "/notify",
                      WATCHDOG_USEC="400000", WATCHDOG_PID=str(os.getpid()))
    os.execvp("prismd", ["prismd", folder + "/gyro.json"])
pid = os.fork()
if pid == 0: child()
seen = []
def until(word):
    while not any(word in s for s in seen): seen.append(notify.recv(4096).decode())
    return next(s for s in seen if word in s)
try:
    until("READY=1"); until("STATUS="); until("WATCHDOG=1"); until("STATUS=receiving")
    peer = socket.socket(socket.AF_UNIX); peer.connect(folder + "/handed.sock")
    peer.sendall(b'{"jsonrpc":"2.0","id":1,"method":"version"}\n'); assert b"prismd" in peer.recv(4096)
    assert not os.path.exists(folder + "/gyro.sock"), "prismd created its own socket in addition to systemd's"
    seen.clear(); os.kill(pid, signal.SIGHUP); assert "MONOTONIC_USEC=" in until("RELOADING=1"); until("READY=1")
    os.kill(pid, signal.SIGTERM); until("STOPPING=1")
    assert os.waitpid(pid, 0)[1] == 0
    assert os.path.exists(folder + "/handed.sock"), "prismd removed systemd's socket"
except BaseException:
    os.kill(pid, signal.SIGKILL); raise
END
