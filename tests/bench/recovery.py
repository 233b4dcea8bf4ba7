#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
# Recovery times of prismd: from plugging in the gyro to a subscriber's first sample, and from the start after a kill -9 to
# the first response and to the first sample. A benchmark, not a test: it prints quantiles and has no limits.
# usage: recovery.py PROGRAM_DIRECTORY [TIMES]
import json
import os
import signal
import socket
import subprocess
import sys
import tempfile
import time

SOURCE = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
PROGRAMS, TIMES = sys.argv[1], int(sys.argv[2]) if len(sys.argv) > 2 else 50
SUBSCRIBE = b'{"jsonrpc":"2.0","id":1,"method":"subscribe","params":{"streams":["sample"]}}\n'


class Listener:
    """A client that is subscribed to samples; reads lines."""

    def __init__(self, path, timeout_s=20):
        end = time.monotonic() + timeout_s
        while True:
            self.socket = socket.socket(socket.AF_UNIX)
            try:
                self.socket.connect(path)
                break
            except OSError:
                self.socket.close()
                if time.monotonic() > end:
                    sys.exit("recovery.py: {}: prismd does not accept connections".format(path))
        self.socket.sendall(SUBSCRIBE)
        self.data = b""
        self.wait_for(b'"result"')

    def wait_for(self, part):
        """Reads until a line contains `part`; returns its arrival time."""
        self.socket.settimeout(30)
        while True:
            lines = self.data.split(b"\n")
            self.data = lines.pop()
            if any(part in line for line in lines):
                return time.monotonic()
            self.data += self.socket.recv(1 << 16)

    def discard(self):
        self.socket.setblocking(False)
        try:
            while self.socket.recv(1 << 16):
                pass
        except BlockingIOError:
            self.data = b""


def start_gyro(folder):
    gyro = subprocess.Popen([PROGRAMS + "/tools/prismsim/prismsim", "--profile", "steady", "--link", folder + "/tty"],
                            stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    end = time.monotonic() + 5
    while not os.path.exists(folder + "/tty"):
        if gyro.poll() is not None or time.monotonic() > end:
            sys.exit("recovery.py: prismsim did not start within 5 s")
        time.sleep(0.0005)
    return gyro, time.monotonic()


def end(process, by):
    process.send_signal(by)
    process.wait()


def print_quantiles(what, seconds, target_ms):
    ms = sorted(1000 * s for s in seconds)
    print("%-44s p50 %7.1f   p95 %7.1f   worst %7.1f ms   (target: %d)" % (what, ms[len(ms) // 2], ms[int(0.95 * len(ms))], ms[-1], target_ms))


def main():
    with tempfile.TemporaryDirectory(prefix="prism-recovery.") as folder:
        path, config = folder + "/gyro.sock", folder + "/gyro.json"
        with open(config, "w", encoding="utf-8") as file:
            json.dump({"line": {"device": folder + "/tty"}, "frames": "trplg", "model": SOURCE + "/config/models/tao2019-model2.json",
                       "log": {"directory": folder + "/log"}, "socket": {"path": path}, "event_level": "error"}, file)
        command = [PROGRAMS + "/daemon/prismd", config]
        gyro, _ = start_gyro(folder)
        daemon = subprocess.Popen(command)
        listener = Listener(path)
        listener.wait_for(b'"sample"')

        for unplugged_s in (0.3, 3):
            replugs = []
            for _ in range(TIMES if unplugged_s < 1 else TIMES // 5):
                end(gyro, signal.SIGTERM)
                time.sleep(unplugged_s)
                listener.discard()
                gyro, begin = start_gyro(folder)
                replugs.append(listener.wait_for(b'"sample"') - begin)
                time.sleep(0.3)
            print_quantiles("plugged in after %g s, first sample" % unplugged_s, replugs, 200)

        responses, samples = [], []
        for _ in range(TIMES):
            end(daemon, signal.SIGKILL)
            begin = time.monotonic()
            daemon = subprocess.Popen(command)
            listener = Listener(path)
            responses.append(time.monotonic() - begin)
            samples.append(listener.wait_for(b'"sample"') - begin)
            time.sleep(0.2)
        print_quantiles("started after kill -9, first response", responses, 50)
        print_quantiles("started after kill -9, first sample", samples, 50)
        end(daemon, signal.SIGTERM)
        end(gyro, signal.SIGTERM)


main()
