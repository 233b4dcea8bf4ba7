#!/usr/bin/python3
# SPDX-License-Identifier: MIT
"""prism-import: every file of cases.json and octave/ is right, or refused with the advice that leads to the right numbers; the files of
import/ give import/NAME.expected; mutants of each format end with one line or the right numbers.
usage: tests/files/importing.py [MUTANTS of each format] (100; PRISM_REWRITE=1 writes the expected files)"""
import csv
import glob
import io
import json
import math
import os
import random
import shlex
import subprocess
import sys
import tempfile
import time

sys.dont_write_bytecode = True
HERE = os.path.dirname(os.path.abspath(__file__))
sys.path[:0] = [HERE, os.path.join(HERE, "../../tools/prism-import")]
import prism_import
from write import EPOCH, N, RATE, TEMP, TIME

PROGRAM = os.path.join(HERE, "../../tools/prism-import/prism_import.py")
UNIT = {"deg/h": (1, 0), "°/h": (1, 0), "deg/s": (3600, 0), "rad/s": (3600 * 180 / math.pi, 0), "K": (1, -273.15), "°F": (1 / 1.8, -32 / 1.8)}
# File: a part of its refusal, and the options that lead to the right numbers (None: the file has none). All others are right without options.
REFUSED = {
    "colon.txt": ("found no row of numbers", ["--separator", ":"]),
    "utf16-no-bom.csv": ("state --encoding, as utf-16-le", ["--encoding", "utf-16-le"]),
    "utf32.csv": ("state --encoding, as utf-16-le or utf-32", ["--encoding", "utf-32"]),
    "matlab-writetable.csv": ("--time \"Time:UNIT\"", ["--time", "Time:s"]),
    "no-names.csv": ("no column of times in 1 column 1", ["--time", "1:s"]),
    "header-row.csv": ("(--header-row 2)", ["--header-row", "2"]),
    "time-ns-stated.csv": ("--time \"time:UNIT\"", ["--time", "time:ns"]),
    "terminal-title.log": ("--first-row", ["--first-row", "2"]),
    "checksum-column.csv": ("--columns leaves the column out", ["--columns", "rate_deg_per_h,T_degC"]),
    "short-row.csv": ("line 21: found 2 fields, expected 3", None),
    "long-row.csv": ("line 21: found 4 fields, expected 3", None),
    "text-cell.csv": ("line 21: column rate_deg_per_h: found \"warm\", expected a number", ["--missing", "warm"]),
    "bad-first-row.csv": ("line 2: found \"0.5 warm 20\", expected 3 fields and numbers as in line 3", ["--first-row", "2", "--lenient"]),
    "thousands-or-decimals.csv": ("\"8,350\" is 8.350 (--decimal \"rate_deg_per_h:,\") or 8350", ["--decimal", ","]),
    "one-column.csv": ("2 columns (--separator comma) or 1 columns (--separator none)", ["--separator", "none", "--interval", "0.5"]),
    "either-date.csv": ("is 2024-04-03 (--time \"time:dmy\") or 2024-03-04 (--time \"time:mdy\")", ["--time", "time:dmy"]),
    "either-date-later.csv": ("\"02/01/2024 23:01:00\" is 2024-01-02 (--time \"time:dmy\") or 2024-02-01", ["--time", "time:dmy"]),
    "time-unknown-unit.csv": ("--time \"time:UNIT\"", ["--time", "time:ns"]),
    "time-minutes.csv": ("minutes and seconds (--time \"time:%M:%S\")", ["--time", "time:%M:%S"]),
    "time-digits.csv": ("or %H%M%S", ["--time", "time:%H%M%S"]),
    "time-kiloseconds.csv": ("as \"1000 s\"", ["--time", "Time (ks):1000 s"]),
    "time-day-fraction.csv": ("one of s ms us ns min h d", ["--time", "time:d"]),
    "units-differ.csv": ("found the unit deg/s in the row of units, expected deg/h", None),
    "grouped-integers.csv": ("1004 (--decimal \"rate_deg_per_h:,\")", ["--decimal", "rate_deg_per_h:,"]),
    "two-names.csv": ("several columns of times in 1 t_s, 2 rate_deg_per_h, 3 t_s", ["--time", "1"]),
    "nul.csv": ("line 3: found a NUL byte", None),
    "names-only.csv": ("found no row of numbers below a line of names", None),
    "empty.csv": ("the file is empty", None),
    "narrow-names.csv": ("line 2: found 3 fields, expected 2", ["--header-row", "0", "--time", "1:s"]),
    "open-quote.csv": ("line 2: found a quote that is not closed", None),
    "backward.csv": ("line 21: column t_s: the time goes back from 9.5 to 1,", None),
    "excel.xlsx": ("is damaged or no Excel file", None), "old.xls": ("is an old Excel file", None), "labview.tdms": ("is a TDMS file", None),
    "px4.ulg": ("ulog2csv", None), "ros.bag": ("is a bag of ROS", None), "ros2.mcap": ("is an MCAP file", None), "packed.csv.gz": ("gunzip", None),
}
faults = []


def run(path, *options):
    """(exit code, stdout, stderr) of the program, in a process of its own as for a user."""
    try:
        done = subprocess.run([PROGRAM, path, *options], capture_output=True, text=True, timeout=60)
    except subprocess.TimeoutExpired:
        return -1, "", "no end after 60 s"
    return done.returncode, done.stdout, done.stderr


def in_seconds(text):
    if "T" not in text:
        return float(text)
    date, _, fraction = text.rstrip("Z").partition(".")
    return (prism_import.datetime.datetime.fromisoformat(date) - EPOCH).total_seconds() + float("0." + (fraction or "0"))


def numbers(text):
    """[(time, value, …)] of a plain table, converted to deg/h and degC by the units in its names; None: missing."""
    names, *rows = csv.reader(io.StringIO(text))
    units = [UNIT.get(prism_import.split_unit(name)[1], (1, 0)) for name in names[1:]]
    return [(in_seconds(row[0]), *(float(cell) * f + o if cell else None for cell, (f, o) in zip(row[1:], units))) for row in rows]


def truth_of(name):
    """The rows that write.py meant, without the columns that it does not have."""
    times, rate, temperature = TIME, RATE, TEMP
    if name == "grouped.csv":
        rate = [round(r / 1e-6, 1) for r in RATE]
    if name == "thousands-or-decimals.csv":
        times, rate, temperature = range(N), [round(r, 3) for r in RATE], [round(t, 3) for t in TEMP]
    if name == "one-column.csv":
        times, rate, temperature = [t - 0.5 for t in TIME], [round(r, 2) for r in RATE], None
    if name == "grouped-integers.csv":
        rate = [700 + 8 * i for i in range(N)]
    if name == "text-cell.csv":
        rate, temperature = [None if i == 19 else r for i, r in enumerate(RATE)], [20 if i == 19 else t for i, t in enumerate(TEMP)]
    if name == "bad-first-row.csv":
        rate = [None, *RATE[1:]]
    if name == "gps.csv":
        return [(t, 2307, *row) for t, *row in zip(times, rate, temperature)]
    if name in ("holes.csv", "holes-excel.csv", "missing.csv"):
        rate = [None if i % 10 == 3 else r for i, r in enumerate(RATE)]
    if name == "either-date.csv":
        times = [t + (prism_import.datetime.datetime(2024, 4, 3, 12) - EPOCH).total_seconds() for t in TIME]
    if name == "either-date-later.csv":
        start = (prism_import.datetime.datetime(2024, 1, 1, 11) - EPOCH).total_seconds()
        times = [start + (i // 30) * 43200 + 60 * (i % 30) for i in range(31)] + [start + 43200 + 86400 + 60 * (i % 30) + (i // 60) * 43200 for i in range(31, N)]
    if name == "time-minutes.csv":
        times = [int(t) for t in TIME]
    if name == "time-digits.csv":
        times = [30 + i for i in range(N)]
    if name == "time-day-fraction.csv":
        times = [43200 + t for t in TIME]
    return list(zip(times, rate, temperature)) if temperature else list(zip(times, rate))


def is_right(found, truth, of_date):
    """Days and minutes have few digits; a time of day may have another origin."""
    if len(found) != len(truth):
        return False
    offset = found[0][0] - truth[0][0] if not of_date else 0
    return all(len(a) == len(b) and abs(a[0] - b[0] - offset) < 1e-5 and all(
        (x is None and y is None) or (x is not None and y is not None and abs(x - y) <= 1e-9 * max(1, abs(y))) for x, y in zip(a[1:], b[1:])) for a, b in zip(found, truth))


def check_cases():
    with open(os.path.join(HERE, "cases.json")) as file:
        cases = json.load(file)
    count = {"right": 0, "refused, then right": 0, "refused": 0}
    for case in cases:
        name = case["file"]
        path, (text, options) = os.path.join(HERE, "data", name), REFUSED.get(name, ("", []))
        if text:
            code, out, err = run(path, "--out", "-")
            if code != 1 or text not in err or not err.startswith(f"prism-import: {path}: ") or err.count("\n") != 1 or out:
                faults.append(f"{name}: exit code {code}, expected the one line with \"{text}\", found \"{err.strip()}\"")
        if options is None:
            count["refused"] += 1
            continue
        code, out, err = run(path, "--out", "-", *options)
        if code or not is_right(numbers(out), truth_of(name), case.get("date") and name != "gps.csv"):
            faults.append(f"{name} {' '.join(options)}: exit code {code}, expected the numbers of write.py, found {numbers(out)[:3] if out else err}")
        count["refused, then right" if text else "right"] += 1
    for name, form in (("unix", "unix"), ("excel-days", "excel"), ("datenum", "datenum"), ("filetime", "filetime"), ("dotnet-ticks", "ticks")):
        code, out, err = run(os.path.join(HERE, f"data/{name}.csv"), "--out", "-", "--time", f"time:{form}")
        if code or not is_right(numbers(out), truth_of(name), True):
            faults.append(f"{name}.csv --time time:{form}: exit code {code}, expected the numbers of write.py, found {out[:200]} {err}")
    for path in glob.glob(os.path.join(HERE, "octave/*.mat")):
        code, _, err = run(path, "--out", "-")
        if "steps of 0.5 may be s, ms or another unit; --time \"s.time:UNIT\"" not in err:
            faults.append(f"{path}: exit code {code}, expected a refusal that asks for the unit, found \"{err.strip()}\"")
        code, out, err = run(path, "--out", "-", "--time", "s.time:s")
        truth = [(i / 2, [8.5, 8.25, 8.125][i % 3], i + 1, i + 11, i + 1) for i in range(10)]
        if code or numbers(out) != truth or any(f"{name}: {size}" not in err for name, size in (("m", "10 x 2"), ("row", "1 x 10"), ("n", "1 x 1"))):
            faults.append(f"{path}: exit code {code}, expected the numbers of make.m and each variable's size, found {out[:200]} {err}")
        count["refused, then right"] += 1
    print(f"{len(cases)} cases and those of Octave: " + ", ".join(f"{number} {what}" for what, number in count.items()))


def check_pairs():
    """import/NAME.expected: for each of its lines "$ OPTIONS" what the program prints for import/NAME."""
    for path in sorted(glob.glob(os.path.join(HERE, "import/*.expected"))):
        with open(path, encoding="utf-8") as file:
            expected = file.read()
        found = ""
        for command in (line for line in expected.split("\n") if line.startswith("$")):
            options = shlex.split(command[1:])
            binary = "--hex" in options
            done = subprocess.run([PROGRAM, path[:-len(".expected")], "--out", "-", *options], capture_output=True, timeout=60)
            out = done.stdout.hex(" ", 16) + "\n" * bool(done.stdout) if binary else done.stdout.decode()
            found += f"{command}\n{out}{done.stderr.decode().replace(os.path.dirname(path) + '/', '')}"
        if os.environ.get("PRISM_REWRITE"):
            with open(path, "w", encoding="utf-8") as file:
                file.write(found)
        elif found != expected:
            faults.append(f"{path}: found\n{found}")


# ---- Mutants ----

def of_text(random_, data):
    """Damage that leaves no other valid number: nothing is changed into or within digits, signs and decimal marks."""
    marks = b"#%&;:|\"'\t \r\n\0\x80\xff*/<>@[]_~"
    at = random_.randrange(len(data))
    lines = data.splitlines(keepends=True)
    row = random_.randrange(len(lines))
    kind = random_.randrange(7)
    if kind == 0:
        return data[:at]
    if kind in (1, 2):
        return data[:at] + bytes([random_.choice(marks)]) + data[at + (kind == 1 and not data[at:at + 1].isdigit() and data[at:at + 1] not in b".,-+"):]
    if kind == 3:
        return b"".join(lines[:row] + lines[row + 1:])
    if kind == 4:
        return b"".join(lines[:row + 1] + lines[row:])
    if kind == 5:
        return b"".join([*lines[:row], lines[row].rstrip(b"\r\n"), *lines[row + 1:]])
    return b"".join(lines[:row] + lines[row:][::-1])


def of_bytes(random_, data):
    """A cut, a changed bit or byte, a part that is missing or zero."""
    at, kind = random_.randrange(len(data)), random_.randrange(6)
    if kind == 0:
        return data[:at]
    if kind == 1:
        return data[:at] + data[at + random_.randrange(1, 64):]
    if kind == 2:
        return data[:at] + bytes(16) + data[at + 16:]
    return data[:at] + bytes([data[at] ^ (1 << random_.randrange(8)) if kind < 5 else random_.randrange(256)]) + data[at + 1:]


def rows_of_truth(found, truth):
    """Every row is one of the truth; values may be missing."""
    known = {round(row[0], 6): row for row in truth}
    return all(round(row[0], 6) in known and all(a is None or a in known[round(row[0], 6)][1:] for a in row[1:]) for row in found)


def columns_of_truth(found, truth, most_changed=0):
    """The columns are those of the truth; some may be missing (named and left out)."""
    known = list(zip(*truth))
    return len(found) == len(truth) and all(min(sum(a != b for a, b in zip(column, other)) for other in known) <= most_changed for column in zip(*found))


def one_changed(found, truth):
    """Numbers without a checksum: a changed byte or run of 16 zeros may be in them."""
    return columns_of_truth(found, truth, 8)


def excel_file():
    import openpyxl
    book = openpyxl.Workbook()
    book.active.append(["t_s", "rate [deg/h]", "T [degC]"])
    for row in zip(TIME, RATE, TEMP):
        book.active.append(row)
    data = io.BytesIO()
    book.save(data)
    return data.getvalue()


def hdf5_file():
    """As MATLAB writes it: a header of 512 bytes, datasets in chunks, compressed."""
    import h5py
    import numpy
    data = io.BytesIO()
    with h5py.File(data, "w", userblock_size=512) as file:
        for name, values in (("time_s", TIME), ("rate", RATE), ("T", TEMP)):
            item = file.create_dataset(name, data=numpy.array([values]), chunks=(1, 25), compression="gzip")
            item.attrs["MATLAB_class"] = numpy.bytes_("double")
    return b"MATLAB 7.3 MAT-file".ljust(124) + b"\0\2IM" + data.getvalue()[128:]


def check_mutants(count, without):
    data = {name: open(os.path.join(HERE, name), "rb").read() for name in (
        "data/plain.csv", "data/german-date.csv", "data/labview.lvm", "data/all-quoted.csv", "data/blanks.txt", "data/campbell.dat", "octave/octave-v6.mat", "octave/octave-v7.mat")}
    truth, octave = list(zip(TIME, RATE, TEMP)), [(i / 2, [8.5, 8.25, 8.125][i % 3], i + 1, i + 11, i + 1) for i in range(10)]
    sent = bytes((i * 37 + 0xA5) % 256 for i in range(960))
    dump = "".join(f"{i:08x}: {sent[i:i + 16].hex(' ', 2)}  {'.' * 16}\n" for i in range(0, len(sent), 16)).encode()
    formats = {"csv": [(data[name], ".csv", of_text, rows_of_truth, truth, []) for name in data if name.startswith("data")],
               "hex": [(dump, ".txt", of_text, lambda found, _: found in sent, None, ["--hex"])]}
    if "numpy" not in without:
        formats["mat level 5"] = [(data["octave/octave-v6.mat"], ".mat", of_bytes, one_changed, octave, ["--time", "s.time:s"]),
                                  (data["octave/octave-v7.mat"], ".mat", of_bytes, columns_of_truth, octave, ["--time", "s.time:s"])]
    if "openpyxl" not in without:
        formats["xlsx"] = [(excel_file(), ".xlsx", of_bytes, columns_of_truth, truth, [])]
    if "h5py" not in without:
        formats["mat 7.3"] = [(hdf5_file(), ".mat", of_bytes, columns_of_truth, truth, [])]
    for name, sources in formats.items():
        begin, good, refused, longest = time.monotonic(), 0, 0, 0
        with tempfile.TemporaryDirectory(prefix="prism-import-") as folder:
            for number in range(count):
                whole, ending, mutate, is_good, rows, options = sources[number % len(sources)]
                mutant = mutate(random.Random(number), whole)
                path, out = os.path.join(folder, "mutant" + ending), os.path.join(folder, "out")
                with open(path, "wb") as file:
                    file.write(mutant)
                started = time.monotonic()
                code, err = in_process(path, "--out", out, *options, folder=folder)
                longest = max(longest, time.monotonic() - started)
                good, refused = good + (code == 0), refused + (code == 1)
                if code == 0:
                    with open(out, "rb") as file:
                        found = file.read()
                    found = found if "--hex" in options else numbers(found.decode())
                if code == 1 and (not err.startswith(f"prism-import: {path}: ") or err.count("\n") != 1 or "Traceback" in err) or code not in (0, 1) \
                        or code == 0 and not is_good(found, rows) or len(os.listdir(folder)) > 4:
                    faults.append(f"{name}, mutant {number}: exit code {code}, \"{err.strip()[:300]}\", expected one line or right numbers"
                                  + (f", found {found[:2]} …" if code == 0 else ""))
        print(f"{name}: {count} mutants, {good} right, {refused} refused, {time.monotonic() - begin:.0f} s, the longest {longest:.1f} s")


def in_process(*arguments, folder):
    """main() of the program, without starting Python for each mutant."""
    sys.stdout.flush()
    saved = [os.dup(1), os.dup(2)]
    files = [open(os.path.join(folder, name), "w+b") for name in ("stdout", "stderr")]
    for number, file in enumerate(files, 1):
        os.dup2(file.fileno(), number)
    try:
        code = prism_import.main([*arguments])
    finally:
        sys.stdout.flush()
        sys.stderr.flush()
        for number, copy in enumerate(saved, 1):
            os.dup2(copy, number)
            os.close(copy)
    files[1].seek(0)
    err = files[1].read().decode(errors="replace")
    for file in files:
        file.close()
    return code, err


def main():
    without = []
    for module in ("numpy", "openpyxl", "h5py"):
        try:
            __import__(module)
        except ImportError:
            without.append(module)
    check_cases()
    check_pairs()
    check_mutants(int(sys.argv[1]) if len(sys.argv) > 1 else 100, without)
    print("\n".join(faults + [f"{len(faults)} faults"]))
    if without and not faults:
        print(f"skipped: no {', '.join('python3-' + module for module in without)} for their formats; the rest passed (tools/setup all)")
        sys.exit(77)
    sys.exit(1 if faults else 0)


if __name__ == "__main__":
    main()
