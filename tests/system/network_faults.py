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
OUTAGE = 5  # s, at least: outages and their effects are measured, because a slow machine makes both longer
REFUSED = 60 if LONG else 6
STALL = 6
LIMIT = 120  # s, for each condition
QUIET = 10 / float(os.environ.get("PRISM_TIME_SCALE", "1"))  # s: events of equal text within it are counted, not repeated
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
        self.held, self.sent, self.polls = [], 0, 0
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
                    self.polls += 1
                    try:
                        self.case.lines[1].send(b"+23.5,OK\r\n")
                    except OSError:
                        pass
            time.sleep(0.02)


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
        silence = 60 if fault == "stall" else 4
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
            client.settimeout(LIMIT)
            client.connect(self.socket)
            client.sendall(json.dumps({"jsonrpc": "2.0", "id": 1, "protocol": 2, "method": method}).encode() + b"\n")
            return json.loads(client.makefile().readline())["result"]

    def states(self):
        status = self.ask("status")
        return status["state"], status["sensor_lines"]["room"]["state"]

    def wait(self, what, condition):
        end = time.monotonic() + LIMIT
        while True:
            try:
                if condition():
                    return
            except OSError:
                pass  # prismd is starting
            if time.monotonic() > end:
                raise AssertionError(f"{what}: not after {LIMIT} s: {self.details()}")
            time.sleep(0.1)

    def wait_receiving(self, what):
        self.wait(f"receiving {what}", lambda: self.states() == ("receiving", "receiving"))

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
        self.wait_receiving("at the start")
        time.sleep(QUIET + 0.5)
        self.begin, self.outage_s = time.monotonic(), 0
        getattr(self, "do_" + self.fault)()
        now = time.time()
        self.wait("a full second after the fault", lambda: any(second > now and samples == RATE for second, _, samples in self.rows()))
        self.wait_receiving("at the end")
        self.fault_s = time.monotonic() - self.begin
        self.judge()

    def end_outage(self):
        self.outage_s = time.monotonic() - self.begin

    def begin_without_name(self):
        def waits():
            status = self.ask("status")
            return status["state"] == "connecting" and f"{self.far_name}: " in status["detail"]

        self.wait("connecting, with the name as reason", waits)
        self.far.state = "on"
        with open("/etc/hosts", "a") as hosts:
            hosts.write(f"{self.far_address} {self.far_name}\n")

    def do_clean(self):
        pass

    def do_fin(self):
        self.far.state = "off"
        time.sleep(OUTAGE)
        self.wait("the line is lost", lambda: self.states()[0] != "receiving")
        self.end_outage()
        self.far.state = "on"

    def do_refused(self):
        self.far.state = "off"
        time.sleep(REFUSED)
        if self.type == "connect":
            self.wait("connection refused", lambda: "connection refused" in self.ask("status")["detail"])
        self.end_outage()
        self.far.state = "on"

    def do_vanish(self):
        if not self.own_network:
            return self.do_fin()
        self.unplug_cable(True)
        time.sleep(OUTAGE)
        self.wait("the line is lost", lambda: self.states()[0] != "receiving")
        self.end_outage()
        self.unplug_cable(False)

    def do_stall(self):
        self.far.state = "stalled"
        time.sleep(STALL)
        self.far.state = "on"

    def do_name(self):
        pass

    def do_suspend(self):
        """The daemon is stopped; the far end restarts without its FIN arriving: the connection is half open."""
        self.daemon.send_signal(signal.SIGSTOP)
        if self.own_network:
            self.unplug_cable(True)
        self.far.state = "off"
        time.sleep(OUTAGE)
        self.end_outage()
        if self.own_network:
            self.unplug_cable(False)
        self.far.state = "on"
        time.sleep(0.5)
        self.daemon.send_signal(signal.SIGCONT)

    def judge(self):
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
        self.count_polls()
        self.count_sockets()
        self.count_frames()

    def count_polls(self):
        """One poller, which polls at most every 200 ms. prismd's counter changes once a second."""
        requests = lambda: self.ask("line")["sensor_lines"]["room"]["polls"]["requests"]
        if self.fault == "stall":
            self.wait("requests of the stall are read", lambda: self.far.polls >= requests() - 3)
        begin = time.monotonic()
        first = before = requests()

        def changed():
            nonlocal begin, first
            now, first = time.monotonic(), requests()
            begin = now if first == before else begin
            return first != before

        self.wait("a poll", changed)
        first_far = self.far.polls
        self.wait("ten polls", lambda: requests() >= first + 10)
        made, arrived, took_s = requests() - first, self.far.polls - first_far, time.monotonic() - begin
        assert made <= took_s / 0.2 + 2, f"{made} polls in {took_s:.2f} s, expected at most one in 0.2 s: one poller"
        assert arrived <= 1.5 * made + 2, f"{arrived} polls arrived, {made} were sent: one poller"

    def count_sockets(self):
        if self.type in ("tty", "udp"):
            return
        ports = {line.port for line in self.lines}
        used = subprocess.run(["ss", "-Htnp", "state", "established"], capture_output=True, text=True).stdout
        mine = [row for row in used.splitlines() if f"pid={self.daemon.pid}," in row]
        assert len(mine) == 2, f"expected one connection for each of the ports {ports}: {mine}"

    def count_frames(self):
        sent = self.far.sent
        margin = RATE if self.type in ("tty", "udp") else RATE // 5  # lost before the line was open
        received = lambda: self.ask("line")["decoder"]["frames"]
        if self.fault in ("clean", "stall", "name"):
            if self.type != "udp" or self.fault != "stall":  # a socket's buffer may be smaller than the burst
                self.wait(f"the frames sent, {sent}", lambda: received() >= sent - margin)
                assert received() <= self.far.sent, f"{received()} frames of {self.far.sent}"
            uncertain = RATE // 5 if self.fault == "stall" else 0  # until it is seen that the frames waited on the way
            timing = self.ask("line")["timing"]
            assert timing["missing_frames"] <= uncertain and timing["resets"] == 0, timing
        self.count_rows(received)

    def rows(self):
        """The log's complete lines: second, arrival, samples."""
        found = []
        for name in sorted(os.listdir(f"{self.folder}/log")):
            if name.endswith(".csv"):
                lines = [line.split(",") for line in open(f"{self.folder}/log/{name}") if line[-1] == "\n" and line[0] != "#"]
                found += [dict(zip(lines[0], line)) for line in lines[1:]] if lines else []
        return [(int(row["time_s"]), float(row["arrival_s"]), int(row["samples"])) for row in found]

    def count_rows(self, received):
        """All received frames are in rows, each in its second; the seconds without all of their frames are the lost time."""
        in_rows = lambda: sum(samples for _, _, samples in self.rows())
        frames = received()
        self.wait(f"rows of {frames} frames", lambda: in_rows() >= frames - 2 * RATE)
        rows = self.rows()
        found, frames = sum(samples for _, _, samples in rows), received()
        assert found <= frames + 2 * RATE, f"{frames} frames, rows {rows}"
        late = STALL + 2 if self.fault in ("stall", "suspend") else 3
        off = [row for row in rows if not -2.5 < row[1] - row[0] < late]
        assert not off, f"rows of another second than that of their arrival: {off}"
        full = {second for second, _, samples in rows if samples == RATE}
        inside = range(rows[0][0] + 1, rows[-1][0])
        hole = sum(second not in full for second in inside)
        least, most = max(int(self.outage_s) - 1, 0), self.fault_s + 2 if self.outage_s else 0  # a second at each end
        if self.fault == "stall":
            least, most = 0, 2  # the frames that are uncertain (see count_frames) may belong to two seconds
        elif self.type == "udp" and self.fault == "suspend":
            least = 0  # the socket's buffer keeps a part
        assert least <= hole <= most, f"{hole} seconds incomplete, expected {least} to {most:.1f}: {rows}"


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
                if case.daemon.wait(LIMIT) != 0:
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
