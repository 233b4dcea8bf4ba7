#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Time and peak memory of prismcal's commands on a long log of prismd, which this script makes.
usage: year.py BIN [--days 365] [--folder FOLDER] [--method stepwise]"""
import argparse
import json
import os
import shutil
import subprocess
import tempfile
import time


def measured(arguments):
    """Exit code, seconds, CPU seconds and peak memory in MB of a command."""
    begin = time.monotonic()
    process = subprocess.Popen(arguments, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    _, status, usage = os.wait4(process.pid, 0)
    return os.waitstatus_to_exitcode(status), time.monotonic() - begin, usage.ru_utime + usage.ru_stime, usage.ru_maxrss / 1024


def make_log(binaries, days, folder):
    config, capture, log = (os.path.join(folder, name) for name in ("year.json", "year.pcap", "log"))
    if os.path.isdir(log):
        return log
    with open(config, "w") as file:
        json.dump({"frames": "second-means", "clock": "device", "model": "tao2019-model2", "name": "year"}, file)
    subprocess.run([os.path.join(binaries, "tools/prismsim/prismsim"), "--profile", "paper", "--hours", str(24 * days), "--frames",
                    "second-means", "--seed", "7", "--flicker", "0.02", "--out", capture], check=True, stderr=subprocess.DEVNULL)
    subprocess.run([os.path.join(binaries, "daemon/prismd"), config, "--replay", capture, "--out", log], check=True,
                   stdout=subprocess.DEVNULL)
    os.remove(capture)
    return log


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("binaries")
    parser.add_argument("--days", type=int, default=365)
    parser.add_argument("--folder", help="keeps the log for the next run")
    parser.add_argument("--method", default="stepwise", help="of train")
    choice = parser.parse_args()
    folder = choice.folder or tempfile.mkdtemp(prefix="prism-year-")
    os.makedirs(folder, exist_ok=True)
    prismcal = os.path.join(choice.binaries, "tools/prismcal/prismcal")
    rows = 86400 * choice.days
    log, out = make_log(choice.binaries, choice.days, folder), os.path.join(folder, "out")
    shutil.rmtree(out, ignore_errors=True)
    os.makedirs(out)
    size = sum(entry.stat().st_size for entry in os.scandir(log))
    print(f"year: {choice.days} days, {rows / 1e6:.2f} million rows, {size / 1e9:.2f} GB, {os.cpu_count()} cores")
    model = os.path.join(out, "model.json")
    for name, arguments in {
            "verify": [log],
            "allan": [log],
            "convert": [log, "--out", os.path.join(out, "year.pcap")],
            "train": [log, "--inputs", "T,dTdt,U", "--method", choice.method, "--force", "--no-earth-rate", "--out", model],
            "evaluate": [model, log, "--in-sample", "--no-earth-rate", "--out", os.path.join(out, "report")],
            "compare": [model, model, "--on", log, "--no-earth-rate"]}.items():
        code, seconds, cpu_s, peak = measured([prismcal, name, *arguments])
        note = "" if code == 0 else f", exit code {code}"
        print(f"{name:<9} {seconds:7.1f} s  {rows / seconds / 1e6:5.2f} million rows/s  {cpu_s:7.1f} CPU s  {peak:7.0f} MB"
              f"  {peak * 1048576 / rows:6.1f} bytes a row{note}", flush=True)
    for name in ("report.html", "report.json"):
        print(f"{name}: {os.path.getsize(os.path.join(out, 'report', name)) / 1e6:.2f} MB")
    shutil.rmtree(out if choice.folder else folder)


main()
