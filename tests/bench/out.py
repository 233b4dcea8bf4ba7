# SPDX-License-Identifier: MIT
# Latency of an output: from the write of a frame on the gyro's line to its arrival at the far end of the output, for prismd, which
# corrects it, and for socat, which only copies the bytes; pseudo-terminals, in turn, five rounds. usage: out.py BUILD
import json
import os
import statistics
import subprocess
import sys
import tempfile
import threading
import time
import tty

sys.path.insert(0, os.path.join(os.path.dirname(os.path.dirname(os.path.abspath(__file__))), "system"))
from out_reader import capture

BYTES, WARM_S, PACED_S, ROUNDS = 20, 150, 4, 5


def terminal(link):
    master, slave = os.openpty()
    tty.setraw(slave)
    os.symlink(os.ttyname(slave), link)
    return master


def frames_of(build, folder, rate):
    source = open("config/frames/trplg.json", encoding="utf-8").read()
    with open(f"{folder}/frames.json", "w", encoding="utf-8") as file:
        file.write(source.replace('"rate_hz": 200', f'"rate_hz": {rate}'))
    subprocess.run([f"{build}/tools/prismsim/prismsim", "--frames", f"{folder}/frames.json", "--profile", "steady", "--hours",
                    str((WARM_S + PACED_S + 2) / 3600), "--out", f"{folder}/gyro.pcap"], check=True, stderr=subprocess.DEVNULL)
    with open(f"{folder}/gyro.pcap", "rb") as file:
        return b"".join(capture(file.read()))


def measure(build, rate, corrects):
    """Latencies of the paced frames in s, and the number of frames that did not arrive."""
    with tempfile.TemporaryDirectory() as folder:
        data = frames_of(build, folder, rate)
        gyro, far = terminal(f"{folder}/gyro"), terminal(f"{folder}/far")
        config = {"line": {"device": f"{folder}/gyro"}, "frames": f"{folder}/frames.json", "clock": "device", "accept_clock": True,
                  "model": os.path.abspath("config/models/tao2019-model2.json"), "log": {"directory": f"{folder}/log"},
                  "socket": {"path": f"{folder}/socket"},
                  "out": [{"line": {"device": f"{folder}/far"}, "frames": "same", "when_unknown": "raw", "unmarked": True}]}
        with open(f"{folder}/gyro.json", "w", encoding="utf-8") as file:
            json.dump(config, file)
        copy = ["socat", "-u", f"{folder}/gyro,raw,echo=0", f"{folder}/far,raw,echo=0"]
        program = subprocess.Popen([f"{build}/daemon/prismd", f"{folder}/gyro.json"] if corrects else copy, stderr=subprocess.DEVNULL)
        arrived = []

        def receive():
            size = 0
            while True:
                size += len(os.read(far, 4096))
                arrived.extend([time.monotonic()] * (size // BYTES - len(arrived)))

        threading.Thread(target=receive, daemon=True).start()
        time.sleep(1)
        warm = WARM_S * rate * BYTES
        at = 0
        while at < warm:  # in pieces that arrive before the next one
            at += os.write(gyro, data[at:min(warm, at + 100 * BYTES)])
            while len(arrived) < at // BYTES:
                time.sleep(0.0005)
        sent, begin = [], time.monotonic()
        for number in range(PACED_S * rate):
            while (now := time.monotonic()) < begin + number / rate:
                time.sleep(max(0, begin + number / rate - now - 0.0001))
            sent.append(time.monotonic())
            os.write(gyro, data[warm + number * BYTES:warm + (number + 1) * BYTES])
        time.sleep(0.3)
        program.kill()
        program.wait()
        paced = arrived[WARM_S * rate:]
        return [b - a for a, b in zip(sent, paced)], len(sent) - len(paced)


def main():
    build = sys.argv[1]
    for rate in (1000, 4000):
        found = {True: [], False: []}
        lost = {True: 0, False: 0}
        for round_number in range(ROUNDS):
            for corrects in (True, False) if round_number % 2 else (False, True):
                latencies, missing = measure(build, rate, corrects)
                lost[corrects] += missing
                ordered = sorted(latencies)
                found[corrects].append([1e6 * ordered[int(share * (len(ordered) - 1))] for share in (0.5, 0.99)])
        print(f"output at {rate} frames/s, median of {ROUNDS} rounds (smallest to largest), us; frames lost: "
              f"prismd {lost[True]}, copy {lost[False]}")
        for at, name in enumerate(("p50", "p99")):
            texts = []
            for corrects, what in ((True, "prismd"), (False, "copy")):
                values = [each[at] for each in found[corrects]]
                texts.append(f"{what} {statistics.median(values):.0f} ({min(values):.0f} to {max(values):.0f})")
            ratio = statistics.median(a[at] / b[at] for a, b in zip(found[True], found[False]))
            print(f"  {name}  {', '.join(texts)}, ratio {ratio:.2f}")


main()
