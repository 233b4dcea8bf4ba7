#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
# How soon prismd is back: from the replugging of the gyro to a subscriber's first sample, and from the start after a kill -9 to
# the first answer and to the first sample. A benchmark, not a test: it prints quantiles and judges nothing.
# usage: recovery.py FOLDER_OF_PROGRAMS [TIMES]
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
    """A client that subscribed to samples, by lines."""

    def __init__(self, path, patience_s=20):
        end = time.monotonic() + patience_s
        while True:
            self.socket = socket.socket(socket.AF_UNIX)
            try:
                self.socket.connect(path)
                break
            except OSError:
                self.socket.close()
                if time.monotonic() > end:
                    sys.exit("recovery.py: prismd does not answer")
        self.socket.sendall(SUBSCRIBE)
        self.data = b""
        self.wait_for(b'"result"')

    def wait_for(self, part):
        """Until a line holds `part`; the time at which it came."""
        self.socket.settimeout(30)
        while True:
            lines = self.data.split(b"\n")
            self.data = lines.pop()
            if any(part in line for line in lines):
                return time.monotonic()
            self.data += self.socket.recv(1 << 16)

    def forget(self):
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
            sys.exit("recovery.py: the simulated gyro does not start")
        time.sleep(0.0005)
    return gyro, time.monotonic()


def end(process, by):
    process.send_signal(by)
    process.wait()


def print_quantiles(what, seconds, wanted_ms):
    ms = sorted(1000 * s for s in seconds)
    print("%-44s p50 %7.1f   p95 %7.1f   worst %7.1f ms   (wanted: %d)" % (what, ms[len(ms) // 2], ms[int(0.95 * len(ms))], ms[-1], wanted_ms))


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

        for gone_s in (0.3, 3):
            replugs = []
            for _ in range(TIMES if gone_s < 1 else TIMES // 5):
                end(gyro, signal.SIGTERM)
                time.sleep(gone_s)
                listener.forget()
                gyro, begin = start_gyro(folder)
                replugs.append(listener.wait_for(b'"sample"') - begin)
                time.sleep(0.3)
            print_quantiles("replugged after %g s, first sample" % gone_s, replugs, 200)

        answers, samples = [], []
        for _ in range(TIMES):
            end(daemon, signal.SIGKILL)
            begin = time.monotonic()
            daemon = subprocess.Popen(command)
            listener = Listener(path)
            answers.append(time.monotonic() - begin)
            samples.append(listener.wait_for(b'"sample"') - begin)
            time.sleep(0.2)
        print_quantiles("started after kill -9, first answer", answers, 50)
        print_quantiles("started after kill -9, first sample", samples, 50)
        end(daemon, signal.SIGTERM)
        end(gyro, signal.SIGTERM)


main()
