# SPDX-License-Identifier: MIT
"""Passes every hostile text to every input. A text that breaks the rule must be rejected with short printable lines, others accepted."""
import json
import os
import re
import subprocess
import sys
import time

from texts import TEXTS, follows

BIN, SOURCE, DIR = sys.argv[1:4]
PRISMD, PRISMCAL, PRISMCTL = (f"{BIN}/{p}" for p in ("daemon/prismd", "tools/prismcal/prismcal", "tools/prismctl/prismctl"))
MODEL = json.load(open(f"{SOURCE}/config/models/tao2019-model2.json"))
FRAMES = json.loads(re.sub(r"^\s*//.*$", "", open(f"{SOURCE}/config/frames/trplg.json").read(), flags=re.M))
HEADER = {"instance": "gyro", "gyro_serial": "70-1", "axis": "z", "model": "none", "remark": "x"}
COLUMNS = open(f"{DIR}/columns").read()
MARK = "HOSTILE"


def path_of(name):
    return os.path.join(DIR.encode(), b"in", name if isinstance(name, bytes) else name.encode())


def write(name, content):
    with open(path_of(name), "wb") as file:
        file.write(content)
    return path_of(name)


def put(document, text):
    """Returns the document as JSON, with the bytes of `text` instead of MARK."""
    quoted = json.dumps(text.decode("utf-8", "surrogateescape"), ensure_ascii=False).encode("utf-8", "surrogateescape")
    return json.dumps(document).encode().replace(f'"{MARK}"'.encode(), quoted)


def check(document):
    return lambda text: [PRISMD, write("x.json", put(document, text)), "--check"]


def log(key):
    def command(text):
        lines = [f"# prism 0.3.0 data log, format 2".encode()]
        lines += [b"# " + k.encode() + b": " + (text if k == key else v.encode()) for k, v in HEADER.items()]
        return [PRISMCAL, "allan", write("x.csv", b"\n".join(lines) + b"\n" + COLUMNS.encode())]
    return command


def column(text):
    return [PRISMCAL, "allan", write("t.csv", b"t_s\t" + text + b"\n" + b"".join(b"%d\t%d\n" % (i, i * 7919 % 13) for i in range(100))), "--column", "2", "--unit", "deg/h", "--interval", "1"]


def file_name(text):
    content = b"# prism 0.3.0 data log, format 2\n# axis: z\n" + COLUMNS.encode()
    return [PRISMCAL, "evaluate", f"{SOURCE}/config/models/tao2019-model2.json", write(text + b".csv", content), "--no-earth-rate"]


def train(option):
    return lambda text: [PRISMCAL, "train", write("l.csv", b"# prism 0.3.0 data log, format 2\n# axis: z\n" + COLUMNS.encode()), "--no-earth-rate", "--force", "--method", "ls",
                         "--inputs", "T", "--out", path_of("m.json"), option + b"=" + text]


def campaign(document):
    return lambda text: [PRISMCAL, "campaign", write("c.json", put(document, text)), "--plan"]


GYRO = {"line": {"device": "/dev/null"}, "frames": f"{SOURCE}/config/frames/trplg.json"}
PLAN = {"name": "lot", "recordings": [{"role": "train", "paths": ["none*"]}, {"role": "repeat", "paths": ["none*"]}], "models": {"a": {}}}
WAYS = {  # name: (rule, function from a text to a command)
    "configuration, name": ("name", check({**GYRO, "name": MARK})),
    "configuration, serial": ("text", check({**GYRO, "gyro": {"serial": MARK}})),
    "configuration, sensor line": ("sensor", check({**GYRO, "sensor_lines": {MARK: {"device": "/dev/null", "columns": {"t": {"column": 1, "unit": "degC"}}}}})),
    "model, name": ("text", check({**MODEL, "name": MARK})),
    "model, serial": ("text", check({**MODEL, "gyro": {"serial": MARK}})),
    "model, provenance": ("long", check({**MODEL, "provenance": {"file": MARK}})),
    "model, key of the provenance": ("long", check({**MODEL, "provenance": {MARK: 1}})),
    "description, title": ("long", check({**FRAMES, "title": MARK})),
    "description, name": ("name", check({**FRAMES, "name": MARK})),
    "log, instance": ("name", log("instance")),
    "log, serial": ("text", log("gyro_serial")),
    "log, axis": ("axis", log("axis")),
    "log, model": ("long", log("model")),
    "log, unknown key": ("long", log("remark")),
    "table, column": ("text", column),
    "file name": ("long", file_name),
    "train --name": ("text", train(b"--name")),
    "train --serial": ("text", train(b"--serial")),
    "campaign, name": ("name", campaign({**PLAN, "name": MARK})),
}
# Bytes that an input cannot carry, or that it interprets before the rule applies: a line end ends a line, a tab ends a cell.
CUT = {"log": (b"\n", b"\r"), "table": (b"\n", b"\r", b"\t", b'"', b",", b";"), "file": (b"/", b"\0"), "train": (b"\0",)}


def expected(way, rule, text):
    """Returns True if the text must be accepted, False if rejected, None if the result does not depend on the rule."""
    if any(c in text for c in CUT.get(way.split(",")[0].split()[0], ())):
        return None
    if way.startswith("campaign") and follows(rule, text):
        return None  # rejected because no recording matches
    if way.startswith(("file", "train")) and len(text) > 100_000 or way.startswith("file") and len(text) > 200:
        return None  # above the kernel's limit of an argument or a file name
    if way.startswith("table") and not is_utf8(text):
        return None  # a table of another encoding is converted
    return follows(rule, text)


def is_utf8(text):
    try:
        text.decode("utf-8")
    except UnicodeDecodeError:
        return False
    return True


def run(way, name, rule, command, text):
    begin = time.monotonic()
    try:
        done = subprocess.run(command(text), stdin=subprocess.DEVNULL, capture_output=True, timeout=30, cwd=path_of(""))
    except (ValueError, OSError):
        return "not passed by the kernel" if expected(way, rule, text) is None else "could not be passed"
    wanted, output = expected(way, rule, text), done.stderr + done.stdout
    where = f"{way} <- {name}"
    assert time.monotonic() - begin < 20, f"{where}: took {time.monotonic() - begin:.0f} s"
    assert done.returncode in (0, 1, 3, 64, 78), f"{where}: exit {done.returncode}: {output[-300:]!r}"
    for line in output.split(b"\n"):
        shown = line.decode("utf-8")  # raises an error if invalid
        assert all(c in "\t\u00a0" or c.isprintable() for c in shown), f"{where}: printed {line!r}"
        assert len(line) < 6000, f"{where}: printed a line of {len(line)} bytes"
    if wanted is not None:
        expectation = "accepted" if wanted else "rejected"
        assert (done.returncode in (0, 3)) == wanted, f"{where}: exit {done.returncode}, expected {expectation}: {output[-400:]!r}"
    return "accepted" if done.returncode in (0, 3) else "rejected"


def main():
    os.makedirs(path_of(""), exist_ok=True)
    ends = {}
    for way, (rule, command) in WAYS.items():
        for name, text in TEXTS.items():
            end = run(way, name, rule, command, text)
            ends[end] = ends.get(end, 0) + 1
    print(", ".join(f"{count} {end}" for end, count in ends.items()))
    assert not [f for f in os.listdir(path_of("")) if f == b"pwned"], "a text was executed"


main()
