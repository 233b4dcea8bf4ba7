#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Data judged before it is used: four hours of a chamber with one fault each; `prismcal train` names it, and its first line
is the conclusion. usage: PRISM_BIN=build/unity tests/files/judged.py [NAME …]"""
import json
import math
import os
import random
import subprocess
import sys
import tempfile

BIN = os.environ["PRISM_BIN"]
PRISMCAL, PRISMD = os.path.join(BIN, "tools/prismcal/prismcal"), os.path.join(BIN, "daemon/prismd")
JUMP = "temperature jumped from {} degC at {} and {}: a fault, or true? If it is a fault: --leave-out {}"
STAYED = JUMP.format("25.0 to 44.9", "7001 s", "stayed", "7001..")
FILLED = "30 s from 7001 s to 7030 s at 9999 deg/h, far from the rest"


def between(t, begin, end):
    return begin < t <= end


# name: (rate, temperature and U of a row, exit code of train, text that it prints on stderr, first line of stdout, options)
FAULTS = {
    "good": (lambda i, t, r, c: (r, c, 5), 0, "", "ready: ", ""),
    "minus-999": (lambda i, t, r, c: (r, -999 if 5000 <= t < 5005 else c, 5), 0,
                  "temperature: 4 s from 5001 s to 5004 s at -999 degC, far from the rest", "ready: ", ""),
    "two-reasons": (lambda i, t, r, c: (r, -999 if i % 500 == 7 else c + 50 if i % 2000 == 11 else c, 5), 0,
                    "temperature: 73 of 28800 values implausible, the first in line 9: found -999 degC, expected -90 to 200", "ready: ", ""),
    "hot": (lambda i, t, r, c: (r, 300 if i % 20 == 0 else c, 5), 1, "found 300 degC, expected -90 to 200; expected at most 1 %", "", ""),
    "jump": (lambda i, t, r, c: (r, c + 50 if 7000 <= t < 7001 else c, 5), 0, "temperature: 2 of 28800 values implausible", "ready: ", ""),
    "jump-stays": (lambda i, t, r, c: (r, c + 20 if t > 7000 else c, 5), 0, STAYED, "not ready: temperature jumped from ", ""),
    "jump-back": (lambda i, t, r, c: (r, c + 20 if between(t, 7000, 7500) else c, 5), 0, "and back at 75", "doubtful: temperature jumped from ", ""),
    "left-out": (lambda i, t, r, c: (r, c + 20 if between(t, 7000, 7500) else c, 5), 0, "--leave-out 7000..7520: 521 seconds left out",
                 "ready: ", "--leave-out 7000..7520"),
    "no-range": (lambda i, t, r, c: (r, c, 5), 1, "--leave-out: found \"7000-7520\", expected FROM..TO", "", "--leave-out 7000-7520"),
    "backwards": (lambda i, t, r, c: (r, c, 5), 1, "--leave-out: found \"7200..3600\", which ends before it begins", "", "--leave-out 7200..3600"),
    # It was silent with --quiet.
    "nothing-left-out": (lambda i, t, r, c: (r, c, 5), 1, "--leave-out: found \"90000..90100\", which contains no second of a recording", "",
                         "--leave-out 90000..90100 --quiet"),
    "kelvin": (lambda i, t, r, c: (r, c + 273.15, 5), 1, "looks like kelvin: --map temperature=COLUMN:K", "", ""),
    "outlier": (lambda i, t, r, c: (1000 if between(t, 7000, 7001) else r, c, 5), 0, "outlier at 7001 s: 1000 deg/h", "ready: ", ""),
    # A code for "no value"; before, its good neighbours were called outliers, and the conclusion was "nothing to compensate".
    "filled": (lambda i, t, r, c: (9999 if between(t, 7000, 7030) else r, c, 5), 0, FILLED, "ready: ", ""),
    "filled-from-a-half": (lambda i, t, r, c: (9999 if between(t, 7000.5, 7029.5) else r, c, 5), 0, FILLED, "ready: ", ""),
    "filled-at-ends": (lambda i, t, r, c: (9999 if t <= 10 or t > 14380 else r, c, 5), 0, "10 s from 1 s to 10 s at 9999 deg/h", "ready: ", ""),
    "filled-often": (lambda i, t, r, c: (9999 if t % 1000 < 20 and t > 900 else r, c, 5), 0, "9 runs more at 9999 deg/h", "ready: ", ""),
    # Longer ones got a false reason and false times; drift over the gap was called a move of the gyro.
    **{f"{name}-{length}": ((lambda value, q, length: lambda i, t, r, c: tuple(value if between(t, 5000, 5000 + length) and k == q else v
                                                                               for k, v in enumerate((r, c, 5 + 1e-4 * math.sin(i)))))(value, q, length),
                            0, f"{quantity}: {length} s from 5001 s to {5000 + length} s at {value:g} {unit}, far from the rest (by ", "ready: ",
                            "--map uhfo=U:V")
       for length in (1200, 7000)
       for name, q, quantity, unit, value in (("rate", 0, "rate", "deg/h", 9999), ("absurd", 0, "rate", "deg/h", 1e9),
                                              ("temperature", 1, "temperature", "degC", -999), ("power-on", 1, "temperature", "degC", 85),
                                              ("uhfo", 2, "uhfo", "V", 9999), ("no-uhfo", 2, "uhfo", "V", 0))},
    "hour-left-out": (lambda i, t, r, c: (r, c, 5), 0, "--leave-out 6001..9600: 3600 seconds left out", "ready: ", "--leave-out 6001..9600"),
    "rate-stops": (lambda i, t, r, c: (8.4 if between(t, 6000, 7200) else r, c, 5), 0,
                   "rate is constant at 8.4 deg/h from 6001 s to 7200 s: a stopped sensor or a code for no value; these values of rate are not used", "ready: ", ""),
    "moved": (lambda i, t, r, c: (r + 5 if t > 7000 else r, c, 5), 1, "--leave-out 6911.. leaves out that one and what follows", "", ""),
    "turned": (lambda i, t, r, c: (r + 40 if between(t, 7000, 7600) else r, c, 5), 0, "(by 39.99 deg/h: a fault, or a turn of the gyro)", "ready: ", ""),
    # It was called noisy and disturbed.
    "rounded": (lambda i, t, r, c: (round(0.05 * c), c, 5), 1, "quantised 1 deg/h; the rate changes in steps of this size", "", ""),
    "other-sign": (lambda i, t, r, c: (-r, c, 5), 0, "the mean rate is -8.6 deg/h, the site's Earth rate 8.65 deg/h: has the rate or the elevation", "doubtful: the mean rate is",
                   "--latitude 35.1 --elevation 90"),
    # East was taken for north.
    "no-azimuth": (lambda i, t, r, c: (r, c, 5), 1, "--azimuth: found none, expected it for an axis that is not vertical", "", "--latitude 35.1 --elevation 0"),
    "stopped": (lambda i, t, r, c: (r, c if t < 5000 else 33, 5), 0, "temperature is constant at 33 degC from 5001 s to 14400 s: a stopped sensor or a code for no value; these values of temperature are not used", "", ""),
    "no-u": (lambda i, t, r, c: (r, c, 0), 1, "input U: always 0: it cannot explain anything; use --inputs T,dTdt", "",
             "--map uhfo=U:V --inputs T,dTdt,U"),
    "no-temperature": (lambda i, t, r, c: (r, None, 5), 1, "found no temperature, expected one", "", ""),
    "placeholder": (lambda i, t, r, c: (r, c, 5), 64, "--latitude: found \"DEG\"", "", "--latitude DEG --elevation DEG"),
}
failed = []


def write(path, fault):
    noise = random.Random(1)
    with open(path, "w") as file:
        file.write("t_s,rate [deg/h],T [degC],U\n")
        for i in range(28800):
            t = (i + 1) / 2
            c = 20 + 15 * math.sin(t / 2500)
            r = 8.4 + 0.01 * c + 0.002 * c * math.cos(t / 2500) + noise.gauss(0, 0.05)
            r, c, u = fault(i, t, r, c)
            file.write(f"{t},{r:.5f},{'' if c is None else f'{c:.4f}'},{u}\n")


def run(*words):
    done = subprocess.run(words, capture_output=True, text=True, timeout=100)
    return done.returncode, done.stdout, done.stderr


def train(recording, out, *options):
    site = [] if "--latitude" in options else ["--no-earth-rate"]
    inputs = [] if "--inputs" in options else ["--inputs", "T,dTdt"]
    return run(PRISMCAL, "train", recording, *inputs, "--method", "stepwise", "--out", out, *site, *options)


def check(name, found, code, err, out):
    if found[0] != code or err not in found[2] or not found[1].startswith(out):
        failed.append(name)
        print(f"{name}: exit code {found[0]}, expected {code}; expected \"{err}\" and \"{out}\", found:\n{found[1]}{found[2]}")


def as_log_and_capture(path, folder):
    """The same recording as a capture and as a log of prismd. convert accepts the options of train for the file."""
    config, capture, log = (os.path.join(folder, name) for name in ("c.json", path + ".pcap", path + ".log"))
    with open(config, "w") as file:
        json.dump({"gyro": {"serial": "X1"}, "frames": "second-means", "clock": "device", "site": {"latitude_deg": 48, "elevation_deg": 90}}, file)
    check("convert", run(PRISMCAL, "convert", path, *MAP, "--no-earth-rate", "--out", capture), 0, "", "")
    check("replay", run(PRISMD, "--replay", capture, "--out", log, config), 0, "", "")
    return config, capture, log


def check_dates(path, folder, model):
    """The same questions as for the table, by date."""
    config, capture, log = as_log_and_capture(path, folder)
    question = JUMP.format("25.0 to 44.9", "1970-01-01T01:56:41Z", "stayed", "1970-01-01T01:56:41Z..")
    for name, recording, options in (("capture", capture, ["--config", config]), ("log", log, [])):
        check(name, train(recording, model, *options), 0, question, "not ready: temperature jumped from ")
        check(name + ", left out", train(recording, model, *options, "--leave-out", "1970-01-01T01:56:41Z.."), 0, ": 7400 seconds left out", "")
        with open(model) as file:
            facts = json.load(file)["provenance"]["recordings"][0]
        if not any("left out" in remark for remark in facts["remarks"]) or "questions" in facts:
            failed.append(name)
            print(f"{name}: the model does not name what was left out: {facts}")
        check(name + ", since the start", train(recording, model, *options, "--leave-out", "7000..14400"), 0, "7000..14400: 740", "")


MAP = ["--map", "rate=rate [deg/h]", "--map", "temperature=T [degC]:degC", "--map", "time=t_s"]
with tempfile.TemporaryDirectory(prefix="prism-judged-") as folder:
    model = os.path.join(folder, "m.json")
    for name, (fault, code, err, out, options) in FAULTS.items():
        if sys.argv[1:] and name not in sys.argv[1:]:
            continue
        path = os.path.join(folder, name + ".csv")
        write(path, fault)
        found = train(path, model, *MAP, *options.split())
        check(name, found, code, err, out)
        if name == "no-u" and "can be used" in found[2] or name == "jump-stays" and "longer or wider" in found[1].splitlines()[0]:
            failed.append(name)
            print(f"{name}: contradicts itself:\n{found[1]}{found[2]}")
        if name == "jump-stays":
            check_dates(path, folder, model)
        elif name == "filled":  # a log is not judged while it is read: the check of its blocks says why
            log = as_log_and_capture(path, folder)[2]
            check("filled log", train(log, model), 1, "not usable for training: outliers 1; expected", "")
            check("filled log", train(log, model), 1, "; --leave-out 6911..7110 leaves them out). Record again", "")
            check("filled log, left out", train(log, model, "--leave-out", "6911..7110"), 0, "", "ready: ")
        elif name == "good":
            found = run(PRISMCAL, "evaluate", model, path, "--map", MAP[1], "--map", MAP[5], "--no-earth-rate")
            check("evaluate without a temperature", found, 1, "found no temperature, expected one (in a table: --map temperature=COLUMN:UNIT", "")
print(f"{len(FAULTS)} recordings, {len(failed)} faults")
sys.exit(1 if failed else 0)
