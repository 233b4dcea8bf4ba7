#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
# Runs a case: a script of commands, or a page of the script or program before the _ in its name, else of check.py; compares all that it prints
# with NAME.expected.
# usage: run.py NAME; run.py --write [NAME]...
# Numbers may differ by one in the last of at most nine digits, by 1e-6 of a longer one: another C library rounds differently. All other numbers and
# the words between must be equal. --write makes the expected output again: review its difference before you commit.
import difflib
import glob
import os
import re
import subprocess
import sys
import tempfile
import time

HERE = os.path.dirname(os.path.abspath(__file__))
PROGRAMS = ["daemon", "tools/prismctl", "tools/prismcal", "tools/prismsim"]
NUMBER = re.compile(r"(?<![\w.])-?\d+(?:\.\d+)?(?:e[+-]?\d+)?(?![\w.]|-\d)|(?<![\w.])-?\d+\.\d+")


def output(name):
    source, programs = os.environ["PRISM_SOURCE"], os.environ["PRISM_BIN"]
    with tempfile.TemporaryDirectory(prefix="prism-outputs-") as folder:
        path = ":".join(f"{programs}/{program}" for program in PROGRAMS)
        environment = {"PATH": f"{path}:{os.environ['PATH']}", "HOME": folder, "LC_ALL": "C.UTF-8", "TZ": "UTC", "SOURCE": source}
        environment |= {name: os.environ[name] for name in ("GLIBC_TUNABLES", "LD_LIBRARY_PATH", "TMPDIR") if name in os.environ}
        stem = f"{HERE}/{name.partition('_')[0]}"
        environment["PAGE"] = f"{HERE}/{name}.txt"
        program = f"{stem}.py" if os.path.exists(f"{stem}.py") else f"{HERE}/check.py"
        script = f". {HERE}/inputs.sh; . {stem}.sh" if os.path.exists(f"{stem}.sh") else f"python3 -B {program} $PAGE"
        done = subprocess.run(["bash", "-euc", script], cwd=folder, env=environment, capture_output=True,
                              stdin=subprocess.DEVNULL, check=False)
    text = (done.stdout + b"== messages\n" + done.stderr).decode("utf-8", errors="backslashreplace") + f"exit {done.returncode}\n"
    text = text.replace(folder, "DIR").replace(source, "SOURCE")
    today = "|".join(time.strftime("%Y-%m-%d", time.gmtime(time.time() - ago)) for ago in (0, 86400))
    text = re.sub(rf"(?:{today})([T ][\d:.]+)?Z?", "NOW", text)
    text = re.sub(r"\bprism(\w*) \d+\.\d+\.\d+", r"prism\1 VERSION", text)
    return re.sub(r"(?<![\w.])(?=[0-9a-f]*[a-f])[0-9a-f]{12,64}\b", "HASH", text)


def near(found, expected):
    """One line: equal words, and numbers that another rounding may give."""
    if found == expected:
        return True
    if NUMBER.sub("#", found) != NUMBER.sub("#", expected):
        return False
    for a, b in zip(NUMBER.findall(found), NUMBER.findall(expected)):
        if a == b:
            continue
        digits = len(re.sub(r"e.*|\D", "", b).lstrip("0"))
        if "." not in b and "e" not in b and digits < 10:
            return False
        decimals, exponent = len(re.sub(r"e.*", "", b).partition(".")[2]), int((b.partition("e")[2]) or 0)
        step = 1.5 * 10.0 ** (exponent - decimals) if digits <= 9 else 1e-6 * abs(float(b)) + 1e-15
        if abs(float(a) - float(b)) > step:
            return False
    return True


def main(arguments):
    if arguments[:1] == ["--write"]:
        for name in arguments[1:] or sorted(os.path.basename(path)[:-len(".expected")] for path in glob.glob(f"{HERE}/*.expected")):
            text = output(name)
            with open(f"{HERE}/{name}.expected", "w", encoding="utf-8") as file:
                file.write(text)
        return 0
    (name,) = arguments
    with open(f"{HERE}/{name}.expected", encoding="utf-8") as file:
        expected = file.read().splitlines()
    found = output(name).splitlines()
    found = [b if near(a, b) else a for a, b in zip(found, expected)] + found[len(expected):]
    differences = list(difflib.unified_diff(expected, found, f"{name}.expected", "found", n=1, lineterm=""))
    print("\n".join(line[:500] for line in differences[:200]))
    return 1 if differences else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
