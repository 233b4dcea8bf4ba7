#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
# Lines through TCP compared with a pseudo-terminal in the same run: jitter of the measured times under bursts of 10 ms, and the delay that
# a network line without an answer adds to the gyro's rows. usage: lines.py DIRECTORY_OF_PROGRAMS
import json
import math
import os
import pty
import select
import shutil
import socket
import statistics
import subprocess
import sys
import tempfile
import termios
import threading
import time

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
sys.path.insert(0, f"{ROOT}/tests/system")
from out_reader import capture

RATE, BURST_S = 1000, 0.010


def packets_of(path):
    return list(capture(open(path, "rb").read()))


class Daemon:
    def __init__(self, bin_dir, folder, members):
        self.socket = f"{folder}/sock"
        config = {"frames": f"{folder}/frames.json", "clock": "host", "write_log": False, "axes": {"z": {}}, "socket": {"path": self.socket}}
        json.dump(dict(config, **members), open(f"{folder}/bench.json", "w"))
        self.process = subprocess.Popen([f"{bin_dir}/daemon/prismd", f"{folder}/bench.json"], stderr=subprocess.DEVNULL)
        for _ in range(500):
            if os.path.exists(self.socket):
                break
            time.sleep(0.01)

    def ask(self, method, params=None):
        with socket.socket(socket.AF_UNIX) as client:
            client.connect(self.socket)
            client.sendall(json.dumps({"jsonrpc": "2.0", "id": 1, "protocol": 2, "method": method, "params": params}).encode() + b"\n")
            return json.loads(client.makefile().readline())["result"]

    def end(self):
        self.process.terminate()
        self.process.wait()


def terminal():
    master, slave = pty.openpty()
    mode = termios.tcgetattr(slave)
    mode[0] = mode[1] = mode[3] = 0
    termios.tcsetattr(slave, termios.TCSANOW, mode)
    return master, slave, os.ttyname(slave)


def send_bursts(writes, packets, seconds):
    """The same bursts to all, in turn first: the jitter of this program's own clock is in all of them."""
    begin, sent = time.monotonic(), 0
    for burst in range(1, int(seconds / BURST_S) + 1):
        time.sleep(max(0, begin + burst * BURST_S - time.monotonic()))
        due = int(burst * BURST_S * RATE)
        data = b"".join(packets[n % len(packets)] for n in range(sent, due))
        for write in writes if burst % 2 else reversed(writes):
            write(data)
        sent = due


class Recorder(threading.Thread):
    """The times of all samples that a daemon publishes."""

    def __init__(self, path):
        super().__init__(daemon=True)
        self.times = []
        self.client = socket.socket(socket.AF_UNIX)
        self.client.connect(path)
        self.client.sendall(b'{"jsonrpc":"2.0","id":1,"method":"subscribe","params":{"streams":["sample"]}}\n')
        self.start()

    def run(self):
        for line in self.client.makefile():
            message = json.loads(line)
            if message.get("method") == "sample":
                self.times.append(message["params"]["time_s"])

    def jitter(self):
        """Standard deviation of the times from a straight line, s; the first 4 s are left out."""
        steps = [value - n / RATE for n, value in enumerate(self.times[4 * RATE :])]
        slope, offset = statistics.linear_regression(range(len(steps)), steps)
        return statistics.pstdev(value - offset - slope * n for n, value in enumerate(steps))


def jitter(bin_dir, folder, packets):
    """Of a pseudo-terminal and of TCP, both at once."""
    listener = socket.create_server(("127.0.0.1", 0))
    master, slave, path = terminal()
    lines = [{"device": path}, {"tcp": {"address": f"127.0.0.1:{listener.getsockname()[1]}"}}]
    daemons, recorders = [], []
    for number, line in enumerate(lines):
        own = f"{folder}/{number}"
        os.makedirs(own, exist_ok=True)
        shutil.copy(f"{folder}/frames.json", own)
        daemons.append(Daemon(bin_dir, own, {"line": line}))
        recorders.append(Recorder(daemons[-1].socket))
    peer = listener.accept()[0]
    peer.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    send_bursts([lambda data: os.write(master, data), peer.sendall], packets, 10)
    time.sleep(0.3)
    for daemon, recorder in zip(daemons, recorders):
        daemon.end()
        recorder.join(5)
    for one in (master, slave):
        os.close(one)
    return [recorder.jitter() for recorder in recorders]


def lateness(bin_dir, folder, packets, stalled):
    """p50 and p99 of the time from the write to the sample's notification, ms."""
    master, slave, path = terminal()
    members = {"line": {"device": path}}
    full = socket.create_server(("127.0.0.1", 0), backlog=0)
    fillers = []
    if stalled:  # its queue is full: the kernel ignores SYNs
        for _ in range(4):
            filler = socket.socket()
            filler.setblocking(False)
            filler.connect_ex(full.getsockname())
            fillers.append(filler)
        members["sensor_lines"] = {"room": {"tcp": {"address": "127.0.0.1:%d" % full.getsockname()[1]}, "columns": {"air": {"column": 1, "unit": "degC"}}}}
    daemon = Daemon(bin_dir, folder, members)
    client = socket.socket(socket.AF_UNIX)
    client.connect(daemon.socket)
    client.sendall(b'{"jsonrpc":"2.0","id":1,"method":"subscribe","params":{"streams":["sample"]}}\n')
    late = []
    for n in range(1500):
        while n > 5 and select.select([client], [], [], 0)[0]:  # samples of earlier frames
            client.recv(1 << 16)
        begin = time.monotonic()
        os.write(master, packets[n % len(packets)])
        if n > 5 and select.select([client], [], [], 0.1)[0]:
            late.append(1000 * (time.monotonic() - begin))
        time.sleep(0.001)
    daemon.end()
    for one in (master, slave):
        os.close(one)
    late.sort()
    return late[len(late) // 2], late[int(0.99 * len(late))]


def main():
    bin_dir = sys.argv[1]
    with tempfile.TemporaryDirectory() as folder:
        text = open(f"{ROOT}/config/frames/trplg.json").read().replace('"rate_hz": 200', f'"rate_hz": {RATE}').replace('"baud": 115200', '"baud": 921600')
        open(f"{folder}/frames.json", "w").write(text)
        subprocess.run([f"{bin_dir}/tools/prismsim/prismsim", "--frames", f"{folder}/frames.json", "--profile", "steady", "--hours", "0.019",
                        "--out", f"{folder}/c.pcap"], check=True, stderr=subprocess.DEVNULL)
        packets = packets_of(f"{folder}/c.pcap")
        # The residual of a round is 0.1 us, or some us if the hull found an earlier frame in it: only many rounds can be compared.
        rounds = [jitter(bin_dir, folder, packets) for _ in range(16)]
        tty, tcp = (math.sqrt(statistics.fmean(value * value for value in column)) for column in zip(*rounds))
        print(f"jitter after the hull, bursts of 10 ms: tty {1e6 * tty:.2f} us, TCP {1e6 * tcp:.2f} us, ratio {tcp / tty:.2f}   <= 1.20")
        pairs = [(lateness(bin_dir, folder, packets, False), lateness(bin_dir, folder, packets, True)) for _ in range(3)]
        alone50, alone99 = (statistics.median(pair[0][i] for pair in pairs) for i in (0, 1))
        beside50, beside99 = (statistics.median(pair[1][i] for pair in pairs) for i in (0, 1))
        print(f"with a network line that does not answer: p50 {alone50:.3f} -> {beside50:.3f} ms, p99 {alone99:.3f} -> {beside99:.3f} ms   <= +1")


if __name__ == "__main__":
    main()
