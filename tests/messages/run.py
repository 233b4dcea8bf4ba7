#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
# Causes the error messages of expected.txt and compares them with that page, line by line. --write updates the page: review its diff
# before you commit.
#
# An indented line of the page is output; the others are the cases. `== NAME` starts a section, with its settings:
# `base FILE` (copied to a scratch directory for each case), `run COMMAND`, `socket` (each case is a request to a running
# prismd). A case is `/path/in/the/json = JSON`, `/path -` (key removed), or `$ COMMAND` for a shell command of its own.
import copy
import difflib
import json
import os
import re
import socket
import subprocess
import sys
import tempfile
import time

HERE = os.path.dirname(os.path.abspath(__file__))
SOURCE, BIN = os.environ["PRISM_SOURCE"], os.environ["PRISM_BIN"]
PAGE = os.path.join(HERE, "expected.txt")
OUTPUT = "    "
PROGRAMS = ["daemon", "tools/prismctl", "tools/prismcal", "tools/prismsim", "tools/prismrelay", "tools/prismweb"]


def read_json(path):
    with open(path, encoding="utf-8") as file:
        return json.loads(re.sub(r"^\s*//.*$", "", file.read(), flags=re.M))


def edited(document, case):
    """Returns a copy of `document` with one member set or removed."""
    path, _, value = case.partition(" = ") if " = " in case else (case.removesuffix(" -"), "", None)
    document = copy.deepcopy(document)
    *parents, last = [int(key) if key.isdigit() else key for key in path.strip("/").split("/")]
    place = document
    for key in parents:
        place = place[key] if isinstance(place, list) else place.setdefault(key, {})
    if value is None:
        del place[last]
    elif isinstance(place, list) and last == len(place):
        place.append(json.loads(value))
    else:
        place[last] = json.loads(value)
    return document


class Scratch:
    """A directory with the inputs of all cases, and the environment of the programs."""

    def __init__(self):
        self.folder = tempfile.TemporaryDirectory(prefix="prism-messages-")
        self.path = self.folder.name
        path = ":".join(os.path.join(BIN, program) for program in PROGRAMS)
        self.environment = {"PATH": f"{path}:{os.environ['PATH']}", "HOME": self.path, "LC_ALL": "C.UTF-8", "SOURCE": SOURCE, "TZ": "UTC",
                            "PRISM_SOCKET": os.path.join(self.path, "gyro.sock"), "LD_LIBRARY_PATH": os.environ.get("LD_LIBRARY_PATH", "")}
        self.children = []
        self.run(["bash", "-e", os.path.join(HERE, "prepare.sh")], check=True)

    def start(self, *command):
        self.children.append(subprocess.Popen(command, cwd=self.path, env=self.environment, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL))

    def close(self):
        for child in reversed(self.children):
            child.terminate()
            child.wait(20)

    def run(self, command, check=False):
        done = subprocess.run(command, cwd=self.path, env=self.environment, capture_output=True, text=True, timeout=120, check=False)
        if check and done.returncode:
            sys.exit(f"{' '.join(command)}: exit {done.returncode}: {done.stderr}")
        return done

    def report(self, command):
        done = self.run(["bash", "-c", command])
        return self.plain(done.stderr) + ([] if done.returncode == 0 else [f"exit {done.returncode}"])

    def plain(self, text):
        """Returns the lines of `text` without paths and times, which differ between machines."""
        for found, shown in ((self.path + "/", ""), (self.path, "DIR"), (SOURCE + "/", "SOURCE/"), (SOURCE, "SOURCE")):
            text = text.replace(found, shown)
        lines = (re.sub(r"^\d{4}-\d\d-\d\dT[\d:.]+Z ", "", line) for line in text.split("\n"))
        return [line.rstrip() for line in lines if line.strip()]


class Daemon:
    """A prismd on a simulated gyro, and one connection to it for each request."""

    def __init__(self, scratch):
        self.scratch = scratch
        scratch.start("prismsim", "--link", "tty")
        self.wait_for("tty", lambda: os.path.exists(os.path.join(scratch.path, "tty")))
        scratch.start("prismd", "--socket", scratch.environment["PRISM_SOCKET"], "live.json")
        self.wait_for("an answer of prismd", lambda: scratch.run(["prismctl", "version"]).returncode == 0)

    @staticmethod
    def wait_for(what, is_there):
        deadline = time.monotonic() + 60
        while not is_there():
            assert time.monotonic() < deadline, f"{what} did not appear"
            time.sleep(0.02)

    def report(self, request):
        with socket.socket(socket.AF_UNIX) as connection:
            connection.settimeout(20)
            connection.connect(self.scratch.environment["PRISM_SOCKET"])
            connection.sendall(request.encode() + b"\n")
            response = json.loads(connection.makefile().readline())
        error = response.get("error", {"code": 0, "message": "no error"})
        return self.scratch.plain(f"{error['code']}: {error['message']}")


def provoke(scratch, page):
    """Yields the lines of the page with the messages that its cases cause now."""
    command, base, daemon = None, None, None
    for line in page:
        if line.startswith(OUTPUT):
            continue
        yield line
        name, _, value = line.partition(" ")
        if not line or name == "==":
            command, base, daemon = None, None, None
        elif name == "base":
            base = read_json(os.path.join(SOURCE, value))
        elif name == "run":
            command = value
        elif line == "socket":
            daemon = Daemon(scratch)
        else:
            yield from (OUTPUT + found for found in messages_of(line, scratch, daemon, base, command) or ["no message"])


def messages_of(case, scratch, daemon, base, command):
    if daemon:
        return daemon.report(case)
    if case.startswith("$ "):
        return scratch.report(case[2:])
    with open(os.path.join(scratch.path, "input.json"), "w", encoding="utf-8") as file:
        json.dump(edited(base, case), file, indent=1)
    return scratch.report(command)


def main(arguments):
    with open(PAGE, encoding="utf-8") as file:
        expected = file.read().rstrip("\n").split("\n")
    scratch = Scratch()
    try:
        found = list(provoke(scratch, expected))
    finally:
        scratch.close()
    if arguments == ["--write"]:
        with open(PAGE, "w", encoding="utf-8") as file:
            file.write("\n".join(found) + "\n")
        return 0
    difference = list(difflib.unified_diff(expected, found, "expected.txt", "found", lineterm=""))
    print("\n".join(difference) or f"{sum(line.startswith(OUTPUT) for line in found)} lines as expected")
    return 1 if difference else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
