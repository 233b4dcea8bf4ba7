#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
# Faults of a gyro line and a polled sensor line on each type of line: which rows prismd serves, which events it reports, and what is
# left open at the end. usage: network_faults.py DIRECTORY CAPTURE FRAMES [TYPE|TYPE-FAULT...], in a network and mount namespace of its own
# (312-network-faults.sh). All cases run at the same time. PRISM_LONG=1: "refused" lasts a minute.
import ctypes
import json
import os
import signal
import socket
import struct
import subprocess
import sys
import threading
import time

sys.dont_write_bytecode = True
from network_far import Tcp, Tty, Udp

RATE = 50  # frames/s
FRAME = 20  # bytes
LONG = bool(os.environ.get("PRISM_LONG"))
OUTAGE = 5
REFUSED = 60 if LONG else 8
TYPES = ("tty", "connect", "listen", "udp")
FAULTS = ("clean", "fin", "vanish", "stall", "refused", "name", "suspend")
LIBC = ctypes.CDLL(None, use_errno=True)
CLONE_NEWNET = 0x40000000


def frames_of(path):
    """The frames of a capture: one packet each."""
    data = open(path, "rb").read()
    at, frames = 24, []
    while at + 16 <= len(data):
        size = struct.unpack_from("<I", data, at + 8)[0]
        body = data[at + 16 : at + 16 + size]
        if body[8] == 2:
            frames.append(body[12:])
        at += 16 + size
    assert all(len(frame) == FRAME for frame in frames)
    return frames


class Far(threading.Thread):
    """The devices of a case: the gyro streams, the thermometer answers "READ?". Runs in the far network namespace, if there is one."""

    def __init__(self, case):
        super().__init__(daemon=True)
        self.case = case
        self.frames = case.frames
        self.held, self.sent, self.polls = [], 0, []
        self.state = "off"  # off, on, stalled
        self.done = False
        self.failures = []
        self.ready = threading.Event()

    def run(self):
        if self.case.own_network:
            if LIBC.unshare(CLONE_NEWNET) != 0:
                raise OSError("unshare")
            self.case.namespace = threading.get_native_id()
        self.ready.set()
        begin, number, plugged = time.monotonic(), 0, False
        heard = b""
        while not self.done:
            wanted = self.state
            if (wanted != "off") != plugged:
                for line in self.case.lines:
                    line.plug() if wanted != "off" else line.unplug()
                plugged = wanted != "off"
            due = int((time.monotonic() - begin) * RATE)
            while number < due:
                frame = self.frames[number % len(self.frames)]
                number += 1
                if wanted == "stalled":
                    self.held.append(frame)
                elif wanted == "on":
                    self.held.append(frame)
                    while self.held:
                        try:
                            self.case.lines[0].send(self.held[0])
                            self.sent += 1
                        except OSError:
                            pass  # lost: as on a line without a reader
                        self.held.pop(0)
            if plugged and wanted == "on":
                heard += self.case.lines[1].receive()
                self.case.lines[0].receive()
                while b"READ?\r\n" in heard:
                    heard = heard.split(b"READ?\r\n", 1)[1]
                    self.polls.append(time.monotonic())
                    try:
                        self.case.lines[1].send(b"+23.5,OK\r\n")
                    except OSError:
                        pass
            time.sleep(0.01)


class Case:
    number = 0

    def __init__(self, folder, type_, fault, frames, description):
        self.type, self.fault = type_, fault
        self.name = f"{type_}-{fault}"
        self.folder = f"{folder}/{self.name}"
        self.frames = frames
        os.makedirs(self.folder)
        Case.number += 1
        port = 4000 + 10 * Case.number
        self.own_network = fault in ("vanish", "suspend") and type_ != "tty"
        self.net = Case.number
        self.near_address = f"10.99.{self.net}.1" if self.own_network else "127.0.0.1"
        self.far_address = f"10.99.{self.net}.2" if self.own_network else "127.0.0.1"
        self.far_name = f"gyro{self.net}.test" if fault == "name" and type_ == "connect" else ""
        make = {"tty": Tty, "connect": lambda *a: Tcp(*a, False), "listen": lambda *a: Tcp(*a, True), "udp": Udp}[type_]
        self.lines = [make(self, "gyro", port), make(self, "room", port + 1)]
        silence = 20 if fault == "stall" else 2.5
        timing = {"silence_s": silence, "retry_min_s": 0.1, "retry_max_s": 1}
        poll = {"every_ms": 200, "send": "READ?\r\n", "within_ms": 100, "pause_ms": 5}
        self.socket = f"{self.folder}/sock"
        config = {
            "name": "gyro", "frames": description, "clock": "device", "axes": {"z": {}},
            "line": dict(self.lines[0].settings, **timing), "socket": {"path": self.socket}, "log": {"directory": f"{self.folder}/log"},
            "sensor_lines": {"room": dict(self.lines[1].settings, **timing, poll=poll, stale_after_s=2.5,
                                          columns={"air": {"column": 1, "unit": "degC"}})},
        }
        json.dump(config, open(f"{self.folder}/gyro.json", "w"))
        self.far = Far(self)

    def connect_networks(self):
        """A cable between this namespace and the far end's."""
        pid = self.far.case.namespace
        near, far = f"n{self.net}", f"f{self.net}"
        run("ip", "link", "add", near, "type", "veth", "peer", "name", far, "netns", str(pid))
        run("ip", "addr", "add", f"{self.near_address}/24", "dev", near)
        run("ip", "link", "set", near, "up")
        inside = ["nsenter", f"--net=/proc/{os.getpid()}/task/{pid}/ns/net"]
        run(*inside, "ip", "link", "set", "lo", "up")
        run(*inside, "ip", "addr", "add", f"{self.far_address}/24", "dev", far)
        run(*inside, "ip", "link", "set", far, "up")
        self.cable = near

    def unplug_cable(self, out):
        run("ip", "link", "set", self.cable, "down" if out else "up")

    def ask(self, method):
        with socket.socket(socket.AF_UNIX) as client:
            client.settimeout(5)
            client.connect(self.socket)
            client.sendall(json.dumps({"jsonrpc": "2.0", "id": 1, "protocol": 2, "method": method}).encode() + b"\n")
            return json.loads(client.makefile().readline())["result"]

    def states(self):
        status = self.ask("status")
        return status["state"], status["sensor_lines"]["room"]["state"]

    def wait_receiving(self, seconds, what):
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            try:
                if self.states() == ("receiving", "receiving"):
                    return
            except OSError:
                pass
            time.sleep(0.1)
        raise AssertionError(f"{what}: not receiving after {seconds} s: {self.details()}")

    def details(self):
        try:
            status = self.ask("status")
            return f"{status['detail']} / {status['sensor_lines']['room']['detail']}"
        except (OSError, KeyError) as error:
            return repr(error)

    def run(self):
        self.far.start()
        self.far.ready.wait(5)
        if self.own_network:
            self.connect_networks()
        if self.fault != "name" or self.type != "connect":
            self.far.state = "on"
        time.sleep(0.2)
        self.daemon = subprocess.Popen(["prismd", f"{self.folder}/gyro.json"], stderr=open(f"{self.folder}/err", "w"))
        if self.fault == "name" and self.type == "connect":
            self.begin_without_name()
        self.wait_receiving(10, "at the start")
        time.sleep(11)  # events of equal text within 10 s are counted, not repeated
        getattr(self, "do_" + self.fault)()
        self.wait_receiving(15, "at the end")
        time.sleep(5 if self.fault == "stall" else 2.5)  # after a stall, the far end reads old requests
        self.judge()

    def begin_without_name(self):
        time.sleep(OUTAGE)
        status = self.ask("status")
        assert status["state"] == "connecting" and f"{self.far_name}: " in status["detail"], status["detail"]
        self.far.state = "on"
        with open("/etc/hosts", "a") as hosts:
            hosts.write(f"{self.far_address} {self.far_name}\n")

    def do_clean(self):
        time.sleep(2)

    def do_fin(self):
        self.far.state = "off"
        time.sleep(OUTAGE)
        assert self.states()[0] != "receiving"
        self.far.state = "on"

    def do_refused(self):
        self.far.state = "off"
        time.sleep(REFUSED)
        if self.type == "connect":
            status = self.ask("status")
            assert "connection refused" in status["detail"], status["detail"]
        self.far.state = "on"

    def do_vanish(self):
        if not self.own_network:
            return self.do_fin()
        self.unplug_cable(True)
        time.sleep(OUTAGE)
        assert self.states()[0] != "receiving"
        self.unplug_cable(False)

    def do_stall(self):
        self.far.state = "stalled"
        time.sleep(10)
        self.far.state = "on"

    def do_name(self):
        time.sleep(1)

    def do_suspend(self):
        """The daemon is stopped; the far end restarts without its FIN arriving: the connection is half open."""
        self.daemon.send_signal(signal.SIGSTOP)
        if self.own_network:
            self.unplug_cable(True)
        self.far.state = "off"
        time.sleep(OUTAGE)
        if self.own_network:
            self.unplug_cable(False)
        self.far.state = "on"
        time.sleep(0.5)
        self.daemon.send_signal(signal.SIGCONT)

    def judge(self):
        self.sent_before = self.far.sent
        line = self.ask("line")
        events = self.ask("events")
        kinds = [event["kind"] for event in events if not event["text"].startswith("room: ")]
        room = [event["kind"] for event in events if event["text"].startswith("room: ")]
        for name, found in (("gyro", kinds), ("room", room)):
            begins = sum(kind in ("line_lost", "line_absent", "line_silent") for kind in found)
            ends = found.count("line_receiving")
            faulty = self.fault not in ("clean", "stall") and not (self.fault == "name" and self.type != "connect")
            tty = self.type == "tty"  # a serial device reports that it is lost, then that it is absent
            expected = {1, 2} if tty and faulty else {0, 1} if self.fault == "suspend" and self.type == "udp" else {int(faulty)}
            assert begins in expected, f"{name}: {begins} reports of the loss: {found}"
            assert ends == (0 if self.far_name else 1) + min(begins, 1), f"{name}: {ends} times receiving: {found}"
        polls = [at for at in self.far.polls if at > time.monotonic() - 2]
        assert 8 <= len(polls) <= 11, f"{len(polls)} polls in 2 s, expected 10: one poller"
        self.count_sockets()
        self.count_frames(line)

    def count_sockets(self):
        if self.type in ("tty", "udp"):
            return
        ports = {line.port for line in self.lines}
        used = subprocess.run(["ss", "-Htnp", "state", "established"], capture_output=True, text=True).stdout
        mine = [row for row in used.splitlines() if f"pid={self.daemon.pid}," in row]
        assert len(mine) == 2, f"expected one connection for each of the ports {ports}: {mine}"

    def count_frames(self, line):
        frames, sent = line["decoder"]["frames"], self.far.sent
        margin = RATE if self.type in ("tty", "udp") else RATE // 5  # on the way, or lost before the line was open
        if self.fault in ("clean", "stall", "name"):
            if self.type != "udp" or self.fault != "stall":  # a socket's buffer may be smaller than the burst
                assert self.sent_before - margin <= frames <= sent, f"{frames} frames of {sent}"
            uncertain = RATE // 5 if self.fault == "stall" else 0  # until it is seen that the frames waited on the way
            assert line["timing"]["missing_frames"] <= uncertain and line["timing"]["resets"] == 0, line["timing"]
        self.count_rows(frames)

    def rows(self):
        """The log's complete lines: second, arrival, samples."""
        found = []
        for name in sorted(os.listdir(f"{self.folder}/log")):
            if name.endswith(".csv"):
                lines = [line.split(",") for line in open(f"{self.folder}/log/{name}") if line[-1] == "\n" and line[0] != "#"]
                found += [dict(zip(lines[0], line)) for line in lines[1:]] if lines else []
        return [(int(row["time_s"]), float(row["arrival_s"]), int(row["samples"])) for row in found]

    def count_rows(self, frames):
        """All received frames are in rows, each in its second; the seconds without all of their frames are the lost time."""
        rows = self.rows()
        assert frames - 2 * RATE <= sum(samples for _, _, samples in rows) <= frames + 2 * RATE, f"{frames} frames, rows {rows}"
        late = 12 if self.fault in ("stall", "suspend") else 2
        off = [row for row in rows if not -1.5 < row[1] - row[0] < late]
        assert not off, f"rows of another second than that of their arrival: {off}"
        full = {second for second, _, samples in rows if samples == RATE}
        inside = range(rows[0][0] + 1, rows[-1][0])
        hole = sum(second not in full for second in inside)
        lost = {"clean": 0, "name": 0, "refused": REFUSED}.get(self.fault, OUTAGE)
        if self.fault == "stall":
            least, most = 0, 2  # the frames that are uncertain (see count_frames) may belong to two seconds
        elif self.type == "udp" and self.fault == "suspend":
            least, most = 0, lost + 3  # the socket's buffer keeps a part
        else:
            least, most = max(lost - 1, 0), lost + 3 if lost else 0  # a second at each end, and the time to connect
        assert least <= hole <= most, f"{hole} seconds incomplete, expected {least} to {most}: {rows}"


def run(*command):
    subprocess.run(command, check=True)


def main():
    folder, capture, description = sys.argv[1:4]
    wanted = sys.argv[4:]
    frames = frames_of(capture)
    run("ip", "link", "set", "lo", "up")
    cases = []
    Case.number = 10 * TYPES.index(wanted[0].split("-")[0]) if wanted else 0
    for type_ in TYPES:
        for fault in FAULTS:
            if not wanted or f"{type_}-{fault}" in wanted or type_ in wanted:
                cases.append(Case(folder, type_, fault, frames, description))
    failed = []

    def play(case):
        try:
            case.run()
        except Exception as error:  # noqa: every fault of a case is reported with its name
            failed.append(f"{case.name}: {type(error).__name__}: {error}\n" + open(f"{case.folder}/err").read()[-1500:])
        finally:
            if hasattr(case, "daemon"):
                case.daemon.send_signal(signal.SIGCONT)
                case.daemon.terminate()
                if case.daemon.wait(10) != 0:
                    failed.append(f"{case.name}: prismd ended with {case.daemon.returncode}")
            case.far.done = True

    threads = [threading.Thread(target=play, args=(case,)) for case in cases]
    for thread in threads:
        thread.start()
        time.sleep(0.05)
    for thread in threads:
        thread.join()
    print(f"{len(cases)} cases, {len(failed)} failed")
    for text in failed:
        print(text)
    sys.exit(bool(failed))


if __name__ == "__main__":
    main()
