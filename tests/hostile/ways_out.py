# SPDX-License-Identifier: MIT
"""Uses the hostile texts that the rules accept as instance, serial number and model name of prismd instances, and checks logs, reports,
socket, terminal and metrics: no text is executed or becomes an element, every output is valid and contains the text unchanged.
tests/system/300-hostile-texts.sh then checks PostgreSQL, MQTT, the relay's metrics and the page."""
import csv
import glob
import html.parser
import json
import os
import re
import subprocess
import sys
import time
import xml.etree.ElementTree

from texts import TEXTS, follows

BIN, SOURCE, DIR = sys.argv[1:4]
PROGRAMS = {p: f"{BIN}/{'daemon' if p == 'prismd' else 'tools/' + p}/{p}" for p in ("prismd", "prismctl", "prismcal", "prismsim", "prismrelay", "prismweb")}
LONGEST = 40  # bytes of an instance name: a socket path has at most 107
TAGS = {"html", "head", "meta", "title", "style", "body", "header", "h1", "h2", "p", "nav", "a", "table", "caption", "thead", "tbody", "tr", "th", "td", "span", "b", "dd", "div", "dl", "dt",
        "section", "figure", "figcaption", "footer", "script", "svg", "g", "path", "rect", "line", "polyline", "polygon", "circle", "text", "tspan", "defs", "clippath", "use",
        "lineargradient", "stop", "desc"}


def run(program, *arguments, **options):
    done = subprocess.run([PROGRAMS[program], *arguments], stdin=subprocess.DEVNULL, capture_output=True, timeout=120, cwd=DIR, **options)
    assert done.returncode in (0, 3), f"{program} {arguments}: {done.returncode}: {done.stderr[-500:]!r}"
    return done.stdout


def gyros():
    """Yields (number, name of the text, instance, text) for each text that is a valid serial number and model name."""
    for number, (name, text) in enumerate(TEXTS.items()):
        if not follows("text", text) or not text:
            continue
        text = text.decode()
        yield number, name, text if follows("name", text.encode()) and len(text.encode()) <= LONGEST else f"gyro{number}", text


class Elements(html.parser.HTMLParser):
    """Collects the elements, attributes and text of a page."""

    def __init__(self, text):
        super().__init__()
        self.tags, self.attributes, self.text = set(), set(), ""
        self.feed(text)

    def handle_starttag(self, tag, attributes):
        self.tags.add(tag)
        self.attributes |= {name for name, _ in attributes}

    def handle_data(self, data):
        self.text += data


def check_report(folder, text):
    page = open(f"{folder}/report.html", encoding="utf-8").read()
    found = Elements(page)
    assert found.tags <= TAGS, f"{text!r}: found elements {found.tags - TAGS}, expected none of them"
    assert not [a for a in found.attributes if a.startswith("on")], f"{text!r}: found an event handler in the attributes {found.attributes}"
    assert text in found.text, f"{text!r} is not in the report"
    for svg in re.findall(r"<svg.*?</svg>", page, re.S):
        xml.etree.ElementTree.fromstring(svg)
    report = json.load(open(f"{folder}/report.json", encoding="utf-8"))
    assert any(text == value or text in value for value in map(str, report["facts"].values() if isinstance(report["facts"], dict) else report["facts"])), report["facts"]
    for table in glob.glob(f"{folder}/tables/*.csv"):
        for row in csv.reader(open(table, encoding="utf-8", newline="")):
            for cell in row:
                number = re.fullmatch(r"[-+]?[0-9.]+([eE][-+]?[0-9]+)?", cell)
                assert not cell[:1] in ("=", "+", "-", "@", "\t", "\r") or number or cell == "", f"{table}: unsafe cell {cell!r}"


def make(number, instance, text):
    """Makes the model, log and report of one gyro, and checks them. Returns their directory."""
    home = f"{DIR}/{number}"
    os.makedirs(home, exist_ok=True)
    model = json.load(open(f"{SOURCE}/config/models/tao2019-model2.json"))
    model.update(name=text, gyro={"serial": text})
    model["provenance"]["note"] = text
    config = {"name": instance, "gyro": {"serial": text}, "frames": f"{DIR}/frames.json", "clock": "device", "model": "./model.json", "line": {"device": f"{home}/tty"},
              "site": {"latitude_deg": 34.25, "elevation_deg": 90}, "socket": {"path": f"{DIR}/s/{instance}.sock"}, "log": {"directory": f"{home}/log"}}
    for name, value in (("model.json", model), ("gyro.json", config)):
        json.dump(value, open(f"{home}/{name}", "w", encoding="utf-8"), ensure_ascii=False)
    run("prismd", f"{home}/gyro.json", "--replay", f"{DIR}/cycle.pcap", "--out", f"{home}/log")
    log = open(glob.glob(f"{glob.escape(home)}/log/*.csv")[0], encoding="utf-8").read()
    assert f"\n# gyro_serial: {text}\n" in log and f" {text}\n" in log, log[:500]
    run("prismcal", "evaluate", f"{home}/model.json", f"{home}/log", "--out", f"{home}/report")
    check_report(f"{home}/report", text)
    return home


def terminal_is_clean(tmux, command, instance):
    """Runs the command in a real terminal; fails if it sets the title. Returns the screen."""
    def call_tmux(*words):
        return subprocess.run(["tmux", "-S", tmux, "-f", f"{tmux}.conf", *words], capture_output=True, text=True, check=True).stdout
    with open(f"{tmux}.conf", "w") as file:
        file.write("set -g remain-on-exit on\n")
    call_tmux("new-session", "-d", "-x", "200", "-y", "50", "-s", "t", *command)
    deadline = time.monotonic() + 20
    while "dead" not in call_tmux("display", "-p", "-t", "t", "#{?pane_dead,dead,}") and time.monotonic() < deadline:
        time.sleep(0.05)
    assert "pwned" not in call_tmux("display", "-p", "-t", "t", "#{pane_title}"), f"{instance}: the title was set"
    shown = call_tmux("capture-pane", "-p", "-e", "-t", "t")
    call_tmux("kill-session", "-t", "t")
    return shown


def check_socket(instance, text):
    socket = f"{DIR}/s/{instance}.sock"
    status = json.loads(run("prismctl", "--socket", socket, "--json", "status"))
    assert (status["name"], status["gyro_serial"]) == (instance, text), status
    for command in ("status", "model", "events"):
        shown = run("prismctl", "--socket", socket, command).decode()
        assert all(c == "\n" or c.isprintable() for c in shown), f"{instance}: {command} printed {shown!r}"
    metrics = run("prismctl", "--socket", socket, "metrics")
    problems = subprocess.run(["promtool", "check", "metrics"], input=metrics, capture_output=True, timeout=60)
    assert problems.returncode == 0 and not problems.stderr, f"{instance}: {problems.stderr!r} {metrics[:300]!r}"
    terminal_is_clean(f"{DIR}/tmux", [PROGRAMS["prismctl"], "--socket", socket, "status"], instance)


def main():
    os.makedirs(f"{DIR}/s", exist_ok=True)
    made = [(*gyro, make(gyro[0], gyro[2], gyro[3])) for gyro in gyros()]
    assert len(made) >= 20, made
    daemons = [subprocess.Popen([PROGRAMS["prismd"], f"{home}/gyro.json"], stderr=open(f"{home}/prismd.err", "wb"), stdin=subprocess.DEVNULL) for *_, home in made]
    with open(f"{DIR}/pids", "w") as file:
        file.write(" ".join(str(d.pid) for d in daemons))
    deadline = time.monotonic() + 60
    answers = lambda instance: subprocess.run([PROGRAMS["prismctl"], "--socket", f"{DIR}/s/{instance}.sock", "version"], capture_output=True).returncode == 0
    while not all(answers(instance) for _, _, instance, _, _ in made):
        assert time.monotonic() < deadline, "a prismd did not answer"
        time.sleep(0.05)
    for _, _, instance, text, home in made:
        check_socket(instance, text)
        for line in open(f"{home}/prismd.err", "rb"):
            assert all(c.isprintable() for c in line.decode().rstrip("\n")), line
    json.dump([{"instance": i, "text": t, "home": h} for _, _, i, t, h in made], open(f"{DIR}/made.json", "w"))
    assert not [f for f in glob.glob(f"{DIR}/**/pwned", recursive=True)], "a text was executed"
    print(f"{len(made)} gyros")


main()
