# SPDX-License-Identifier: MIT
# Fifty clients of prismweb on one gyro of 1000 frames/s: does each get every sample, in how many messages, what does it cost, and what
# does another subscriber of prismd notice. usage: web.py BUILD [CLIENTS [SECONDS]]
import asyncio
import json
import os
import re
import socket
import subprocess
import sys
import tempfile
import time

import websockets

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
BUILD = os.path.abspath(sys.argv[1])
CLIENTS = int(sys.argv[2]) if len(sys.argv) > 2 else 50
SECONDS = float(sys.argv[3]) if len(sys.argv) > 3 else 20


def wait_for(what):
    for _ in range(200):
        if what():
            return
        time.sleep(0.05)
    sys.exit("web.py: the programs did not start")


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
    web = subprocess.Popen([f"{BUILD}/tools/prismweb/prismweb", "--listen", "127.0.0.1:0", "--state", f"{folder}/state", "--instance",
                            f"{folder}/gyro.sock"], env=environment, stdout=subprocess.PIPE, text=True)
    run.append(web)
    port, token = re.match(r"http://127.0.0.1:(\d+)/#token=(\w+)", web.stdout.readline()).groups()
    time.sleep(3)
    return run, port, token


class Subscriber:
    """Of prismd itself, in a process of its own: a line a sample, and how late it came."""

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

    def figures(self):
        return json.loads(self.process.communicate()[0])


def cpu_s(pid):
    fields = open(f"/proc/{pid}/stat").read().rsplit(")", 1)[1].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


async def client(url, token):
    async with websockets.connect(url, max_size=None, compression=None) as page:
        await page.send(json.dumps({"token": token}))
        name = json.loads(await page.recv())["instances"][0]["name"]
        await page.send(json.dumps({"jsonrpc": "2.0", "id": 1, "instance": name, "method": "subscribe", "params": {}}))
        await page.recv()
        messages, samples, first, last, lost = 0, 0, None, None, 0
        end = time.monotonic() + SECONDS
        while time.monotonic() < end:
            text = await page.recv()
            messages += 1
            times = re.findall(r'"method":"sample","params":{"axis":"z","time_s":([0-9.]+)', text)
            samples += len(times)
            lost += text.count('"method":"lost"')
            first, last = first or float(times[0]), float(times[-1]) if times else last
        return messages / SECONDS, samples, round((last - first) * 1000) + 1, lost


async def main(port, token):
    return await asyncio.gather(*[client(f"ws://127.0.0.1:{port}/ws", token) for _ in range(CLIENTS)])


with tempfile.TemporaryDirectory() as folder:
    programs, port, token = start(folder)
    try:
        before = Subscriber(f"{folder}/gyro.sock").figures()
        web = programs[-1].pid
        subscriber, used, began = Subscriber(f"{folder}/gyro.sock"), cpu_s(web), time.monotonic()
        clients = asyncio.run(main(port, token))
        share = (cpu_s(web) - used) / (time.monotonic() - began)
        beside = subscriber.figures()
        memory = int(re.search(r"VmHWM:\s+(\d+)", open(f"/proc/{web}/status").read())[1]) / 1024
    finally:
        for program in reversed(programs):
            program.terminate()
            program.wait()
short = sum(samples < due for _, samples, due, _ in clients)
print(f"clients {CLIENTS}, {SECONDS:g} s: messages a second {max(c[0] for c in clients):.1f} at most; short of a sample: {short}; lost: "
      f"{sum(c[3] for c in clients)}; samples {min(c[1] for c in clients)} to {max(c[1] for c in clients)}")
print(f"prismweb: {share * 100:.1f} % of a core, {memory:.1f} MiB at most")
print(f"another subscriber of prismd, p99: {before['p99_ms']:.2f} ms without, {beside['p99_ms']:.2f} ms beside")
