# SPDX-License-Identifier: MIT
"""Servers for the browser tests: the fake server with simulated gyros, or the real prismsim, prismd and prismweb."""
import glob
import json
import os
import signal
import struct
import subprocess
import sys
import tempfile
import time

HERE = os.path.dirname(os.path.abspath(__file__))
ROOT = os.path.dirname(os.path.dirname(HERE))
WINDOW_S = 5
SCRIPT = "<script>document.title='taken'</script><img src=x onerror=\"document.title='taken'\">"


CAPTURE_HEAD, PACKET_HEAD = 24, 16  # of a pcap file


def first_second(path):
    with open(path, "rb") as file:
        file.seek(CAPTURE_HEAD)
        return struct.unpack("<I", file.read(4))[0]


def shift_capture(path, shift_s):
    """Moves every packet by `shift_s` seconds."""
    with open(path, "rb") as file:
        data = bytearray(file.read())
    at = CAPTURE_HEAD
    while at + PACKET_HEAD <= len(data):
        second, _, size = struct.unpack_from("<III", data, at)
        struct.pack_into("<I", data, at, second + shift_s)
        at += PACKET_HEAD + size
    with open(path, "wb") as file:
        file.write(data)


class StandIn:
    """The fake server, tests/page/stand_in.py; say() sends it a command."""

    def __init__(self, *arguments):
        self.process = subprocess.Popen([sys.executable, os.path.join(HERE, "stand_in.py"), "0", *arguments],
                                        stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        self.url = self.process.stdout.readline().strip()

    def say(self, command):
        self.process.stdin.write(command + "\n")
        self.process.stdin.flush()

    def close(self):
        self.process.kill()
        self.process.wait()
        self.process.stdin.close()
        self.process.stdout.close()


class Real:
    """The real programs: a simulated gyro on a pseudo-terminal, its prismd, and prismweb on a free port."""

    about = {"gyro": {"serial": "SIMULATED"}, "site": {"latitude_deg": 34.25, "elevation_deg": 90}}

    def __init__(self, programs, hurry=False, days=0):
        """`hurry`: 400 times the speed, 10 frames per second of the device's clock, so that an hour of data takes nine seconds.
        `days`: prismd's log begins with this number of days, up to the current time; does not start prismweb."""
        self.programs, self.hurry, self.children = os.path.abspath(programs), hurry, {}
        self.folder = tempfile.TemporaryDirectory(prefix="prism-page.")
        self.path = self.folder.name
        self.train()
        self.write("gyro1.json", {**self.about, "line": {"device": f"{self.path}/tty", "silence_s": 1, "retry_min_s": 0.05, "retry_max_s": 0.2},
                                  "frames": f"{self.path}/slow.json" if hurry else "trplg", "clock": "device" if hurry else "host", "accept_clock": hurry, "model": f"{self.path}/model.json",
                                  "log": {"directory": f"{self.path}/log"}, "socket": {"path": f"{self.path}/gyro1.sock"}})
        if days:
            self.lay_log(days)
        self.plug()
        self.start_prismd()
        self.url = None if days else self.start_prismweb()

    def train(self):
        """Trains a model with a short window, so that correction begins soon, and with a name that is markup."""
        self.write_frames()
        self.write("record.json", {**self.about, "line": {"device": "/none"}, "frames": f"{self.path}/slow.json", "clock": "device"})
        for program, *arguments in [
                ("tools/prismsim/prismsim", "--frames", "slow.json", "--profile", "fast", "--hours", "4", "--out", "cycle.pcap"),
                ("daemon/prismd", "record.json", "--replay", "cycle.pcap", "--out", "cycle"),
                ("tools/prismcal/prismcal", "train", "cycle", "--method", "stepwise", "--window", str(WINDOW_S), "--end-mean", "2", "--name", SCRIPT, "--out", "model.json", "--quiet", "--force")]:
            self.do(program, *arguments)

    def write_frames(self):
        with open(os.path.join(ROOT, "config/frames/trplg.json")) as file:
            frames = file.read().replace('"rate_hz": 200', '"rate_hz": 10')
        with open(os.path.join(self.path, "slow.json"), "w") as file:
            file.write(frames)

    def do(self, program, *arguments):
        done = subprocess.run([os.path.join(self.programs, program), *arguments], cwd=self.path, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
        assert done.returncode == 0, f"{program}: {done.stderr}"

    def lay_log(self, days):
        """Makes a log of this number of days by a replay at one frame per second."""
        self.do("tools/prismsim/prismsim", "--frames", "slow.json", "--rate", "1", "--hours", str(24 * days), "--out", "days.pcap")
        shift_s = int(time.time()) - 60 - days * 86400 - first_second(f"{self.path}/days.pcap")
        shift_capture(f"{self.path}/days.pcap", shift_s)
        with open(f"{self.path}/gyro1.json") as file:
            settings = json.load(file)
        with open(f"{self.path}/slow.json") as file:
            frames = file.read().replace('"rate_hz": 10', '"rate_hz": 1')
        with open(f"{self.path}/one.json", "w") as file:
            file.write(frames)
        self.write("days/gyro1.json", {**settings, "frames": f"{self.path}/one.json", "clock": "device"})
        self.do("daemon/prismd", "days/gyro1.json", "--replay", "days.pcap", "--out", "log")
        os.unlink(f"{self.path}/days.pcap")

    def write(self, name, value):
        path = os.path.join(self.path, name)
        os.makedirs(os.path.dirname(path), exist_ok=True)
        with open(path, "w") as file:
            json.dump(value, file)

    def start(self, name, program, *arguments):
        log = open(os.path.join(self.path, f"{name}.err"), "a")
        self.children[name] = subprocess.Popen([os.path.join(self.programs, program), *arguments], stdout=subprocess.PIPE, stderr=log, text=True)
        log.close()
        return self.children[name]

    def end(self, name, how=signal.SIGKILL):
        child = self.children.pop(name)
        child.send_signal(how)
        child.wait()
        child.stdout.close()

    def plug(self):
        self.start("prismsim", "tools/prismsim/prismsim", "--profile", "steady", "--link", f"{self.path}/tty",
                   *(["--speed", "400", "--frames", f"{self.path}/slow.json"] if self.hurry else []))
        self.wait_for(f"{self.path}/tty")

    def unplug(self):
        self.end("prismsim", signal.SIGTERM)

    def start_prismd(self):
        self.start("prismd", "daemon/prismd", f"{self.path}/gyro1.json")
        self.wait_for(f"{self.path}/gyro1.sock")

    def start_prismweb(self, port=0):
        os.environ["XDG_RUNTIME_DIR"] = self.path
        web = self.start("prismweb", "tools/prismweb/prismweb", "--listen", f"127.0.0.1:{port}", "--instance", f"{self.path}/gyro1.sock",
                         "--page", os.path.join(ROOT, "tools/prismweb/page"), "--state", f"{self.path}/state")
        for line in web.stdout:
            if "http://" in line:
                return line[line.index("http://"):].split()[0]
        raise AssertionError("prismweb printed no address: " + self.said("prismweb"))

    def rows(self):
        """Returns the number of rows in prismd's log."""
        count = 0
        for path in glob.glob(f"{self.path}/log/*.csv"):
            with open(path) as file:
                count += sum(1 for line in file if line[:1].isdigit())
        return count

    def stored_bytes(self):
        """Returns the size of prismweb's store."""
        return sum(os.path.getsize(path) for path in glob.glob(f"{self.path}/state/**", recursive=True) if os.path.isfile(path))

    def said(self, name):
        with open(os.path.join(self.path, f"{name}.err")) as file:
            return file.read()[-2000:]

    @staticmethod
    def wait_for(path, seconds=10):
        deadline = time.monotonic() + seconds
        while not os.path.exists(path):
            assert time.monotonic() < deadline, f"{path} did not appear within {seconds} s"
            time.sleep(0.02)

    def close(self):
        for name in list(self.children):
            self.end(name)
        self.folder.cleanup()


class RealAxes(Real):
    """A device with three axes and no models, which marks its y axis as invalid after `valid_s` seconds."""

    def __init__(self, programs, valid_s):
        self.programs, self.hurry, self.children, self.valid_s = os.path.abspath(programs), False, {}, valid_s
        self.folder = tempfile.TemporaryDirectory(prefix="prism-page.")
        self.path = self.folder.name
        self.write("gyro1.json", {"site": {"latitude_deg": 34.25}, "line": {"device": f"{self.path}/tty", "silence_s": 1}, "frames": "stim300", "log": {"directory": f"{self.path}/log"},
                                  "socket": {"path": f"{self.path}/gyro1.sock"}, "axes": {axis: {"elevation_deg": 90 * (axis == "z")} for axis in "xyz"}})
        self.plug()
        self.start_prismd()
        self.url = self.start_prismweb()

    def plug(self):
        self.start("prismsim", "tools/prismsim/prismsim", "--profile", "steady", "--frames", "stim300", "--axis", "x,y,z", "--elevation", "0,0,90",
                   "--azimuth", "0,90,0", "--invalid", f"y:{self.valid_s}:1e9", "--link", f"{self.path}/tty", "--wait")
        self.wait_for(f"{self.path}/tty")
