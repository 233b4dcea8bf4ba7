#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
# Runs prismd --check on changed copies of a JSON file, and prints what it finds. usage: check.py PAGE (of cases, see limits.txt)
# `base FILE` or `base {...}`: the file to change, relative to the source tree; `set /pointer = JSON`: a change for all cases that follow,
# until the next `base`; `base` alone: the same again.
# `/pointer = JSON | JSON`: a case for each value; `&& /pointer = JSON` behind a value: a change in addition; `-` instead of a value: removed.
# <90*a> is 90 times the text a. A vector that expects 1e300 shows the value.
import os
import re
import subprocess
import sys

sys.path.insert(0, os.environ["SOURCE"] + "/tests/messages")
os.environ |= {"PRISM_SOURCE": os.environ["SOURCE"], "PRISM_BIN": ""}
import run  # noqa: E402


def changed(document, changes):
    for change in changes.split(" && "):
        change = re.sub(r"<(\d+)\*([^>]*)>", lambda match: int(match[1]) * match[2], change)
        document = run.edited(document, change.replace(" = -", " -") if change.endswith(" = -") else change)
    return document


def checked(document):
    with open("input.json", "w", encoding="utf-8") as file:
        run.json.dump(document, file, indent=1)
    done = subprocess.run(["prismd", "--check", "input.json"], capture_output=True, text=True, check=False)
    text = "; ".join((done.stderr + done.stdout).strip().split("\n"))
    text = re.sub(r"/\S*/config/", "config/", text)
    text = re.sub(r"prismd: |input\.json:|/vectors/0: |; expected 1e\+300", "", text)
    text = re.sub(r"0 of \d+ bytes are a frame.*the check does not: ", "", text)
    text = re.sub(r"note: (a configuration finds it by its file|the frame cannot prove).*?; ", "", text)
    text = re.sub(r'gives "(.{6})(.{6})\.{3}": it was.*', r"gives \1 \2", text)  # run.py leaves out hashes
    return re.sub(r" ?good: (?!model).*", "good", text) if done.returncode in (0, 78) else f"exit {done.returncode}: {text}"


document = base = None
for line in open(sys.argv[1], encoding="utf-8").read().split("\n"):
    word, _, rest = line.partition(" ")
    if word == "base":
        base = rest or base
        document = run.json.loads(base) if base.startswith("{") else run.read_json(f"{os.environ['SOURCE']}/{base}")
    elif word == "set":
        document = changed(document, rest)
    elif word.startswith("/"):
        found = [(value, checked(changed(document, f"{word} = {value}"))) for value in rest.removeprefix("= ").split(" | ")]
        good = " | ".join(value for value, result in found if result == "good")
        line = "\n  ".join([f"{word} = {good}" if good else word] + [f"{value}: {result}" for value, result in found if result != "good"])
    if line:
        print(line)
