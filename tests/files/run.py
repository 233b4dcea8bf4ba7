#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Each file of tests/files/data (write.py made them from one truth) through each command of prismcal that reads tables: the
same result as data/plain.csv, or the same refusal, and then the same Allan deviation of what prism-import makes of it.
usage: PRISM_BIN=build/unity tests/files/run.py [NAME …]"""
import csv
import json
import os
import re
import struct
import subprocess
import sys
import tempfile

HERE = os.path.dirname(os.path.abspath(__file__))
sys.dont_write_bytecode = True
sys.path.insert(0, HERE)
from importing import REFUSED

IMPORT = os.path.join(HERE, "../../tools/prism-import/prism_import.py")
# Damaged on purpose, or with other numbers than plain.csv: importing.py has their truth.
OTHER_TRUTH = ("bad-first-row.csv", "text-cell.csv", "thousands-or-decimals.csv", "one-column.csv", "grouped-integers.csv", "either-date-later.csv",
               "time-minutes.csv", "time-digits.csv", "narrow-names.csv")
DATA = os.path.join(HERE, "data")
PRISMCAL = os.path.join(os.environ["PRISM_BIN"], "tools/prismcal/prismcal")
faults = []


def run(*arguments):
    try:
        done = subprocess.run([PRISMCAL, *arguments], capture_output=True, text=True, timeout=20)
    except subprocess.TimeoutExpired:
        return -1, "", "no end after 20 s"
    return done.returncode, done.stdout, done.stderr


def payloads(path):
    """The data of a capture's packets, and their times since the first."""
    with open(path, "rb") as file:
        data = file.read()
    at, packets, first = 24, [], None
    while at + 16 <= len(data):
        seconds, nanos, length, _ = struct.unpack_from("<IIII", data, at)
        first = seconds if first is None else first
        packets.append((seconds - first, nanos, data[at + 16:at + 16 + length].hex()))
        at += 16 + length
    return packets


def commands(case, folder):
    """Name and arguments of each command for a file. The last three take turns: each file through one of them."""
    path = os.path.join(DATA, case["file"])
    columns = case["columns"]
    options = [o for o in case["options"] if o not in ("--scaled", "--nearly", "--holes")]
    # Headers with a unit need none in --map; those with a comma or colon are given by number.
    entries = [f"rate={columns['rate']}" + ("" if has_unit(columns["rate"]) else ":deg/h"),
               f"temperature={columns['temperature']}" + ("" if has_unit(columns["temperature"]) else ":degC"),
               f"time={columns['time']}"]
    mapping = [word for entry in entries for word in ("--map", entry)]
    time = columns["time"].split(":")[0]
    out, fit = os.path.join(folder, "out"), os.path.join(folder, "fit.json")
    applied = [*mapping, "--no-earth-rate", "--accept-unit", "--json", *options]
    all_commands = {
        "allan": ["allan", path, "--column", columns["rate"], "--time", time, "--json", *options,
                  *([] if has_unit(columns["rate"]) else ["--unit", "deg/h"])],
        "fit": ["fit", path, "--inputs", columns["temperature"], "--target", columns["rate"], "--method", "lssvm", "--c", "10",
                "--sigma2", "1", "--json", "--out", fit, *options],
        "predict": ["predict", fit, path, "--out", out + ".csv", "--json", *options],  # with the model of fit
        "evaluate": ["evaluate", os.path.join(folder, "seconds.json"), path, "--in-sample", *applied],
        "compare": ["compare", *[os.path.join(folder, "seconds.json")] * 2, "--on", path, *applied],
        "cv": ["cv", path, "--inputs", columns["temperature"], "--target", columns["rate"], "--method", "lssvm", "--c", "10",
               "--sigma2", "1", "--json", *options],
        "convert": ["convert", path, *mapping, "--out", out + ".pcap", *options],
    }
    turns = ("predict", "evaluate", "compare")
    if "turn" in case:
        for name in turns:
            if name != turns[case["turn"] % 3]:
                del all_commands[name]
    return all_commands


def finish(what, found):
    """Prints the faults and ends the program: 1 if there are any."""
    for fault in found:
        print(fault)
    print(f"{what}, {len(found)} faults")
    sys.exit(1 if found else 0)


def has_unit(name):
    return name not in ("rate", "T", "rate_x", "Temp", "r", "1", "2", "3", "4")


# Results of an iteration, which magnifies the rounding of a unit's conversion.
FITTED = {"low_deg_per_h", "high_deg_per_h", "edf", "low", "high", "sigma", "value", "relative_sigma", "noises", "coefficients", "fit"}


def nearly(a, b, tolerance):
    if isinstance(a, dict):
        return set(a) == set(b) and all(nearly(a[k], b[k], max(tolerance, 1e-5) if k in FITTED else tolerance) for k in a)
    if isinstance(a, list):
        return len(a) == len(b) and all(nearly(x, y, tolerance) for x, y in zip(a, b))
    if isinstance(a, (int, float)) and isinstance(b, (int, float)):
        return abs(a - b) <= tolerance * max(abs(a), abs(b), 1e-9)
    return a == b


def predictions(path):
    """The last three columns, which predict adds."""
    with open(path, encoding="utf-8", newline="") as file:
        separator = file.readline().rstrip("\r\n")[-len("sd_mean") - 1]
        rows = [row[-3:] for row in csv.reader(file, delimiter=separator) if row]
    return [[float(cell.replace(",", ".")) if cell else None for cell in row] for row in rows]


def result(name, out, folder):
    """What must be equal of a command's output."""
    if name == "convert":
        return payloads(os.path.join(folder, "out.pcap"))
    if name == "predict":
        return predictions(os.path.join(folder, "out.csv"))
    json_out = json.loads(out)
    if name == "allan":
        rows = [[cell.get("value") for cell in row] for row in json_out["tables"]["points"]["rows"]]
        read = re.search(r"(\d+) values of .*, every (\S+) s \(.*\), (\d+) gap", json_out["facts"]["data"])
        return {"read": [float(number) for number in read.groups()], "points": [row[:2] for row in rows], "fit": [row[2:4] for row in rows]}
    if name in ("evaluate", "compare"):
        return [cell["value"] for table in json_out["tables"].values() for row in table["rows"] for cell in row if "value" in cell]
    return {key: json_out[key] for key in json_out if key not in ("model", "id", "inputs", "model_id", "seconds", "names")}


def check_same(case, plain, folder):
    tolerance = 1e-6 if set(case["options"]) & {"--nearly"} else 1e-12
    reference = case.get("reference", plain)
    for name, arguments in commands(case, folder).items():
        code, out, err = run(*arguments)
        where = f"{case['file']}: {name}"
        if code != 0:
            faults.append(f"{where}: exit code {code}: {err.strip()}")
            continue
        if not any(line.startswith(os.path.join(DATA, case["file"]) + ": ") for line in err.splitlines()):
            faults.append(f"{where}: no line of how the file was understood, found {err!r}")
        found = result(name, out, folder)
        if "--scaled" in case["options"]:
            continue
        if "--holes" in case["options"]:
            if name == "allan" and found["read"][2] != 6:
                faults.append(f"{where}: found {found['read'][2]} holes, expected 6")
            continue
        if name == "convert" and case["date"]:  # the frame begins with its time and ends with a checksum
            found = [(seconds, nanos, frame[8:-6]) for seconds, nanos, frame in found]
            expected = [(seconds, nanos, frame[8:-6]) for seconds, nanos, frame in reference[name]]
        else:
            expected = reference[name]
        # Days with few digits put some rows into another second.
        moved = tolerance > 1e-9 and (name == "convert" or (case["date"] and name in ("evaluate", "compare")))
        if not nearly(found, expected, tolerance) and not moved:
            faults.append(f"{where}: differs from plain.csv: {str(found)[:200]} instead of {str(expected)[:200]}")
    code, out, err = run("inspect", os.path.join(DATA, case["file"]), "--json",
                         *[o for o in case["options"] if o not in ("--scaled", "--nearly", "--holes")])
    json_out = json.loads(out)
    if code != 0 or json_out["rows"] != 60:
        faults.append(f"{case['file']}: inspect: exit code {code}, {json_out['rows']} rows, expected 60; {json_out['problem']}")
    if json_out["time"] and json_out["time"]["interval_s"] and abs(json_out["time"]["interval_s"] - 0.5) > 1e-4:
        faults.append(f"{case['file']}: inspect: every {json_out['time']['interval_s']} s, expected 0.5")


def check_refused(case, folder):
    expected = case["refused"].replace("FILE", os.path.join(DATA, case["file"]))
    timeless = "inspect" in case  # the columns are good; only their time is not
    for name, arguments in commands(case, folder).items():
        if name == "predict" or (timeless and name in ("fit", "cv")):  # predict: fit made no model
            continue
        code, _, err = run(*arguments)
        if code != 1 or expected not in err or len(err.strip().splitlines()) != 1:
            faults.append(f"{case['file']}: {name}: exit code {code}, expected the one line \"{expected}\", found \"{err.strip()}\"")


def check_imported(case, plain, folder):
    """A file that is not a plain table, through prism-import with the options of importing.py: its second column is the rate."""
    text, options = REFUSED.get(case["file"], ("", []))
    if options is None or {"--scaled", "--holes"} & set(case["options"]) or case["file"] in OTHER_TRUTH:
        return
    table = os.path.join(folder, "imported.csv")
    done = subprocess.run([IMPORT, os.path.join(DATA, case["file"]), "--out", table, *options], capture_output=True, text=True)
    code, out, err = run("allan", table, "--column", "3" if case["file"] == "gps.csv" else "2", "--json",
                         "--unit", "deg/s" if case["file"] == "labview-units.lvm" else "deg/h")
    tolerance = 1e-6 if "--nearly" in case["options"] or case["file"] == "time-day-fraction.csv" else 1e-12
    if done.returncode or code or not nearly(result("allan", out, folder), plain["allan"], tolerance):
        faults.append(f"{case['file']}: prism-import, then allan: exit codes {done.returncode}, {code}: {(done.stderr + err).strip()}, {out[:300]}")


def check_words(folder):
    """What a user sees: the finished command line, and silence with --quiet."""
    path = os.path.join(DATA, "plain.csv")
    code, _, err = run("train", path, "--out", os.path.join(folder, "m.json"))
    line = f"prismcal train {path} --map rate=rate_deg_per_h:deg/h --map temperature=T_degC:degC --map time=t_s:s --latitude DEG --elevation DEG --inputs T,dTdt --out model.json"
    if code != 1 or line not in err:
        faults.append(f"plain.csv: train without --map: exit code {code}, expected \"{line}\", found \"{err.strip()}\"")
    code, out, _ = run("inspect", path)
    if code != 0 or line not in out:
        faults.append(f"plain.csv: inspect: exit code {code}, expected \"{line}\"")
    code, out, _ = run("inspect", os.path.join(DATA, "time-ns-stated.csv"), "--time-unit", "ns")
    if "time-ns-stated.csv --time-unit ns --map rate=rate_deg_per_h" not in out:
        faults.append(f"time-ns-stated.csv: inspect: the option is not in the command line: {out}")
    for name, arguments in commands({"file": "plain.csv", "options": ["--quiet"], "columns": {"time": "t_s", "rate": "rate_deg_per_h",
                                                                                              "temperature": "T_degC"}}, folder).items():
        code, _, err = run(*arguments)
        if code != 0 or err:
            faults.append(f"plain.csv: {name} --quiet: exit code {code}, found \"{err.strip()}\"")


def main():
    with open(os.path.join(HERE, "cases.json")) as file:
        cases = json.load(file)
    wanted = sys.argv[1:]
    with tempfile.TemporaryDirectory(prefix="prism-files-") as folder:
        plain_case = dict(next(case for case in cases if case["file"] == "plain.csv"))
        code, _, err = run("train", os.path.join(DATA, "plain.csv"), "--map", "rate=rate_deg_per_h:deg/h", "--map",
                           "temperature=T_degC:degC", "--map", "time=t_s:s", "--no-earth-rate", "--inputs", "T", "--method", "ls",
                           "--window", "1", "--end-mean", "1", "--force", "--quiet", "--out", os.path.join(folder, "seconds.json"))
        if code != 0:
            sys.exit(f"plain.csv: train: exit code {code}: {err}")
        plain = {}
        for name, arguments in commands(plain_case, folder).items():
            code, out, err = run(*arguments)
            if code != 0:
                sys.exit(f"plain.csv: {name}: exit code {code}: {err}")
            plain[name] = result(name, out, folder)
        check_words(folder)
        for turn, case in enumerate(cases):
            case["turn"] = turn
            if wanted and case["file"] not in wanted:
                continue
            if "refused" in case:
                check_refused(case, folder)
                check_imported(case, plain, folder)
            else:
                check_same(case, plain, folder)
    finish(f"{len(cases)} files", faults)


if __name__ == "__main__":
    main()
