#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Data judged before it is used: four hours of a chamber with one fault each; `prismcal train` names it.
usage: PRISM_BIN=build/unity tests/files/judged.py"""
import math
import os
import random
import subprocess
import sys
import tempfile

PRISMCAL = os.path.join(os.environ["PRISM_BIN"], "tools/prismcal/prismcal")
FAULTS = {  # name: (rate and temperature of a row, exit code of train, text that it prints)
    "good": (lambda i, t, r, c: (r, c), 0, ""),
    "minus-999": (lambda i, t, r, c: (r, -999 if 5000 <= t < 5005 else c), 0, "temperature: 10 of 28800 values implausible, the first in line 10001: found -999 degC"),
    "hot": (lambda i, t, r, c: (r, 300 if i % 20 == 0 else c), 1, "found 300 degC, expected -90 to 200; expected at most 1 %"),
    "jump": (lambda i, t, r, c: (r, c + 50 if 7000 <= t < 7001 else c), 0, "temperature: 2 of 28800 values implausible"),
    "jump-stays": (lambda i, t, r, c: (r, c + 20 if t >= 7000 else c), 0, "degC in line 14001 and stays: a fault, or true?"),
    "kelvin": (lambda i, t, r, c: (r, c + 273.15), 1, "looks like kelvin: --map temperature=COLUMN:K"),
    "outlier": (lambda i, t, r, c: (1000 if 7000 < t <= 7001 else r, c), 0, "outlier at 7001 s: 1000 deg/h"),
    "stopped": (lambda i, t, r, c: (r, c if t < 5000 else 33), 0, "temperature stays at 33 degC from 5001 s to 14400 s"),
}


def main():
    failed = 0
    with tempfile.TemporaryDirectory(prefix="prism-judged-") as folder:
        for name, (fault, expected, text) in FAULTS.items():
            path = os.path.join(folder, name + ".csv")
            noise = random.Random(1)
            with open(path, "w") as file:
                file.write("t_s,rate [deg/h],T [degC]\n")
                for i in range(28800):
                    t = (i + 1) / 2
                    c = 20 + 15 * math.sin(t / 2500)
                    r = 8.4 + 0.01 * c + 0.002 * c * math.cos(t / 2500) + noise.gauss(0, 0.05)
                    r, c = fault(i, t, r, c)
                    file.write(f"{t},{r:.5f},{c:.4f}\n")
            done = subprocess.run([PRISMCAL, "train", path, "--map", "rate=rate [deg/h]", "--map", "temperature=T [degC]:degC", "--map", "time=t_s",
                                   "--no-earth-rate", "--inputs", "T,dTdt", "--method", "stepwise", "--out", os.path.join(folder, "m.json")],
                                  capture_output=True, text=True, timeout=100)
            if done.returncode != expected or text not in done.stderr:
                failed += 1
                print(f"{name}: exit code {done.returncode}, expected {expected}; expected \"{text}\", found:\n{done.stderr}")
    print(f"{len(FAULTS)} recordings, {failed} faults")
    sys.exit(1 if failed else 0)


main()
