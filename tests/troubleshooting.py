#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Each message in a column "message" of docs/troubleshooting.md is one that a program prints: its parts between "…" are in
the sources. usage: tests/troubleshooting.py [FOLDER of the sources]"""
import os
import re
import sys

SOURCE = sys.argv[1] if len(sys.argv) > 1 else os.path.join(os.path.dirname(os.path.abspath(__file__)), "..")
FOLDERS = ("base", "clients", "compensation", "config", "daemon", "drivers", "tools", "systemd", "packaging")
# Of systemd and of the kernel; names in place of "…"; words that the program puts together.
OTHERS = {"looked for", "Read-only file system", "service-start-limit-hit", "Permission denied", "cannot be written: No space left on device",
          "periods.sqlite: No space left on device", "postgresql … DOWN"}


def literals():
    """All string literals of the sources as one text; adjacent ones are joined, as by the compiler."""
    text = []
    for folder in FOLDERS:
        for path, _, names in os.walk(os.path.join(SOURCE, folder)):
            for name in names:
                if name.endswith((".cpp", ".hpp", ".js", ".py", ".html", ".service", ".socket", ".in", ".sh")):
                    with open(os.path.join(path, name), encoding="utf-8", errors="replace") as file:
                        text.append(re.sub(r'"\s*"', "", file.read().replace('\\"', "\u0001")))
    return "\n".join(text).replace("\u0001", '"')


def messages():
    """Line number and message of each row."""
    with open(os.path.join(SOURCE, "docs/troubleshooting.md"), encoding="utf-8") as file:
        wanted = False
        for number, line in enumerate(file, 1):
            if not line.startswith("|"):
                wanted = False
            elif line.startswith("|message"):
                wanted = True
            elif wanted:
                for message in re.findall(r"`([^`]+)`", line.split("|")[1]):
                    yield number, message


def main():
    sources = literals()
    faults, count = [], 0
    for number, message in messages():
        count += 1
        if message in OTHERS:
            continue
        for part in message.split("…"):
            part = part.strip(" \",;:")
            if len(part) > 3 and part not in sources:
                faults.append(f"docs/troubleshooting.md:{number}: no program prints \"{part}\" of \"{message}\"")
    print("\n".join([*faults, f"{count} messages, {len(faults)} that no program prints"]))
    sys.exit(1 if faults else 0)


main()
