#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Fake thermometer that sends lines of numbers, on a pseudo-terminal or in a capture made from a virtual gyro's truth file.

thermometer.py --link PATH          a line every 0.2 s: line number, temperature (20 degC, rising by 0.01 degC per line), 101325 Pa
thermometer.py TRUTH.csv OUT.pcap   a line per row of the truth file: time, and temperature of the gyro's own thermometer at that time
"""
import csv
import os
import struct
import sys
import time

START = 1767225600  # start time of prismsim's captures
LINK_TYPE, OPENED, DATA = 250, 0, 2


def live(link):
    master, slave = os.openpty()
    if os.path.lexists(link):
        os.unlink(link)
    os.symlink(os.ttyname(slave), link)
    import tty

    tty.setraw(slave)
    for i in range(10**9):
        os.write(master, f"{i},{20 + 0.01 * i:.3f},101325\r\n".encode())
        time.sleep(0.2)


def packet(time_s, event, data):
    second, nano = int(time_s), round(time_s % 1 * 1e9)
    body = struct.pack(">IIBBH", second, nano // 1000, event, 0, 0) + data
    return struct.pack("<IIII", second, nano, len(body), len(body)) + body


def capture(truth, out):
    with open(truth, encoding="utf-8") as text, open(out, "wb") as pcap:
        pcap.write(struct.pack("<IHHIIII", 0xA1B23C4D, 2, 4, 0, 0, 65535, LINK_TYPE))
        pcap.write(packet(START, OPENED, b""))
        for row in csv.DictReader(line for line in text if not line.startswith("#")):
            line = f"{row['time_s']};{float(row['sensor_degc']):.4f}\n"
            pcap.write(packet(float(row["time_s"]), DATA, line.encode()))


if __name__ == "__main__":
    live(sys.argv[2]) if sys.argv[1] == "--link" else capture(sys.argv[1], sys.argv[2])
