# SPDX-License-Identifier: MIT
# Fifty clients of prismweb on one gyro of 1000 frames/s: samples and messages per client, CPU and memory, and the delay of another
# subscriber of prismd. usage: web.py BUILD_DIRECTORY [CLIENTS [SECONDS]]
import json
import os
import re
import selectors
import socket
import struct
import subprocess
import sys
import tempfile
import time

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
BUILD = os.path.abspath(sys.argv[1])
CLIENTS = int(sys.argv[2]) if len(sys.argv) > 2 else 50
SECONDS = float(sys.argv[3]) if len(sys.argv) > 3 else 20


def wait_for(what):
    for _ in range(200):
        if what():
            return
        time.sleep(0.05)
    sys.exit("web.py: the programs did not start within 10 s")


def start(folder):
    frames = open(f"{ROOT}/config/frames/trplg.json").read().replace('"rate_hz": 200', '"rate_hz": 1000')
    open(f"{folder}/frames.json", "w").write(frames)
    json.dump({"line": {"device": f"{folder}/tty"}, "frames": f"{folder}/frames.json", "model": f"{ROOT}/config/models/tao2019-model2.json",
               "log": {"directory": f"{folder}/log"}, "socket": {"path": f"{folder}/gyro.sock"}}, open(f"{folder}/gyro.json", "w"))
    quiet = {"stderr": subprocess.DEVNULL, "stdout": subprocess.DEVNULL}
    run = [subprocess.Popen([f"{BUILD}/tools/prismsim/prismsim", "--link", f"{folder}/tty", "--frames", f"{folder}/frames.json", "--profile",
                             "steady", "--hours", "2"], **quiet)]
    wait_for(lambda: os.path.exists(f"{folder}/tty"))
    run.append(subprocess.Popen([f"{BUILD}/daemon/prismd", f"{folder}/gyro.json"], **quiet))
    wait_for(lambda: os.path.exists(f"{folder}/gyro.sock"))
    environment = {**os.environ, "XDG_RUNTIME_DIR": folder}
    web = subprocess.Popen(["nice", "-n", "5", f"{BUILD}/tools/prismweb/prismweb", "--listen", "127.0.0.1:0", "--state", f"{folder}/state", "--instance",
                            f"{folder}/gyro.sock"], env=environment, stdout=subprocess.PIPE, text=True)
    run.append(web)
    port = re.match(r"http://127.0.0.1:(\d+)/", web.stdout.readline()).group(1)
    token = open(f"{folder}/prismweb-{port}.token").read().strip()
    time.sleep(3)
    return run, port, token


class Subscriber:
    """A direct subscriber of prismd in a separate process; measures the delay of each sample."""

    CODE = """
import json, socket, sys, time
s = socket.socket(socket.AF_UNIX); s.connect(sys.argv[1])
s.sendall(b'{"jsonrpc":"2.0","id":1,"method":"subscribe","params":{"streams":["sample"]}}\\n')
end, late, rest = time.monotonic() + float(sys.argv[2]), [], b""
while time.monotonic() < end:
    data = s.recv(65536); now = time.time()
    lines = (rest + data).split(b"\\n"); rest = lines.pop()
    late += [now - float(line.split(b'"time_s":', 1)[1].split(b",", 1)[0]) for line in lines if b'"sample"' in line]
late.sort()
print(json.dumps({"samples": len(late), "p50_ms": late[len(late) // 2] * 1e3, "p99_ms": late[len(late) * 99 // 100] * 1e3}))
"""

    def __init__(self, path):
        self.process = subprocess.Popen([sys.executable, "-c", self.CODE, path, str(SECONDS)], stdout=subprocess.PIPE, text=True)

    def results(self):
        return json.loads(self.process.communicate()[0])


def cpu_s(pid):
    fields = open(f"/proc/{pid}/stat").read().rsplit(")", 1)[1].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def send(line, request):
    text = json.dumps(request).encode()
    head = bytes([0x81, 0x80 | len(text)]) if len(text) < 126 else bytes([0x81, 0xFE]) + struct.pack(">H", len(text))
    line.sendall(head + bytes(4) + text)  # masked with zeros


def subscribed(port, token):
    """Connects a subscribed client. It stores the received bytes unparsed, because parsing would take CPU time from the measured programs."""
    line = socket.create_connection(("127.0.0.1", int(port)))
    line.sendall(f"GET /ws HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
                 "Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n".encode())
    while b"\r\n\r\n" not in line.recv(4096):
        pass
    send(line, {"token": token})
    greeting = json.loads(next(texts_of(line.recv(65536))))
    send(line, {"jsonrpc": "2.0", "id": 1, "instance": greeting["instances"][0]["name"], "method": "subscribe", "params": {}})
    line.setblocking(False)
    return line


def read_all(port, token):
    """Returns the data that each client received in SECONDS. The clients represent fifty other machines, so they use only idle CPU time.
    (nice 19 is not enough: since Linux 6.6 a running process keeps the core for its slice of milliseconds when another one wakes up.)"""
    os.sched_setscheduler(0, os.SCHED_IDLE, os.sched_param(0))
    lines = {subscribed(port, token): [] for _ in range(CLIENTS)}
    with selectors.DefaultSelector() as ready:
        for line in lines:
            ready.register(line, selectors.EVENT_READ)
        end = time.monotonic() + SECONDS
        while time.monotonic() < end:
            for key, _ in ready.select(0.1):
                lines[key.fileobj].append(key.fileobj.recv(1 << 20))
    for line in lines:
        line.close()
    return [b"".join(parts) for parts in lines.values()]


def texts_of(data):
    """The text messages of a server, RFC 6455; the last one may be incomplete."""
    at = 0
    while at + 10 <= len(data):
        kind, size, at = data[at] & 15, data[at + 1] & 127, at + 2
        if size >= 126:
            width = 2 if size == 126 else 8
            size, at = int.from_bytes(data[at:at + width], "big"), at + width
        if kind == 1 and at + size <= len(data):
            yield data[at:at + size]
        at += size


def client_results(data):
    """Messages per second, samples, samples due between the first and the last, reported losses."""
    batches = [text for text in texts_of(data) if b'"batch":[' in text]
    times = [float(time_s) for text in batches for time_s in re.findall(rb'"method":"sample","params":{"axis":"z","time_s":([0-9.]+)', text)]
    return len(batches) / SECONDS, len(times), round((times[-1] - times[0]) * 1000) + 1, data.count(b'"method":"lost"')


with tempfile.TemporaryDirectory() as folder:
    programs, port, token = start(folder)
    try:
        before = Subscriber(f"{folder}/gyro.sock").results()
        web = programs[-1].pid
        subscriber, used, began = Subscriber(f"{folder}/gyro.sock"), cpu_s(web), time.monotonic()
        read = read_all(port, token)
        share = (cpu_s(web) - used) / (time.monotonic() - began)
        during = subscriber.results()
        clients = [client_results(data) for data in read]
        memory = int(re.search(r"VmHWM:\s+(\d+)", open(f"/proc/{web}/status").read())[1]) / 1024
    finally:
        for program in reversed(programs):
            program.terminate()
            program.wait()
short = sum(samples < due for _, samples, due, _ in clients)
print(f"clients {CLIENTS}, {SECONDS:g} s: at most {max(c[0] for c in clients):.1f} messages per second; clients with missing samples: {short}; lost: "
      f"{sum(c[3] for c in clients)}; samples {min(c[1] for c in clients)} to {max(c[1] for c in clients)}")
print(f"prismweb: {share * 100:.1f} % of a core, {memory:.1f} MiB maximum")
print(f"another subscriber of prismd, p99: {before['p99_ms']:.2f} ms before, {during['p99_ms']:.2f} ms with the clients")
