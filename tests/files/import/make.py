#!/usr/bin/python3
# SPDX-License-Identifier: MIT
"""Writes the binary files of this folder from the truth of write.py; the texts are in the forms of other programs, written once. Their
.expected are written by PRISM_REWRITE=1 ../importing.py 0 and reviewed. usage: make.py"""
import datetime
import os
import struct
import sys
import zlib

sys.dont_write_bytecode = True
HERE = os.path.dirname(os.path.abspath(__file__))
sys.path.insert(0, os.path.join(HERE, ".."))
from write import EPOCH, RATE, TEMP, TIME

ROWS = 12
STAMPS = [EPOCH + datetime.timedelta(seconds=t) for t in TIME[:ROWS]]
DATA = list(zip(STAMPS, RATE, TEMP))


def put(name, data):
    with open(os.path.join(HERE, name), "wb") as file:
        file.write(data)


def comma(value):
    return f"{value:.5f}".replace(".", ",")


def excel():
    import openpyxl
    book = openpyxl.Workbook()
    book.active.title = "Messung"
    for row in (["Prüfling 70-0042"], ["Zeit", "Drehrate [°/h]", "Temperatur (°C)", "U"], *([d, comma(r), comma(c), 5.25] for d, r, c in DATA)):
        book.active.append(row)
    book.create_sheet("Notizen").append(["one row"])
    book.save(os.path.join(HERE, "excel-decimal-commas.xlsx"))


def element(kind, data):
    return struct.pack("<II", kind, len(data)) + data + bytes(-len(data) % 8)


def matrix(name, class_, shape, body):
    return element(14, element(6, struct.pack("<II", class_, 0)) + element(5, struct.pack("<ii", *shape)) + element(1, name.encode()) + body)


def doubles(name, rows):
    """A matrix of doubles, by rows."""
    values = [row[c] for c in range(len(rows[0])) for row in rows]
    return matrix(name, 6, (len(rows), len(rows[0])), element(9, struct.pack(f"<{len(values)}d", *values)))


def structure(name, fields):
    return matrix(name, 2, (1, 1), element(5, struct.pack("<i", 8)) + element(1, b"".join(key.encode().ljust(8, b"\0") for key, _ in fields)) + b"".join(value for _, value in fields))


def matlab():
    """As NaveGo saves its sensors: structs with vectors, matrices of 3 columns and texts, with another time each; a chamber as rows."""
    imu = structure("imu", [("t", doubles("", [[t] for t in TIME[:ROWS]])), ("fb", doubles("", [[0.0, 0.0, -9.8]] * ROWS)),
                            ("wb", doubles("", [[0.0, r, 0.0] for r in RATE[:ROWS]])), ("freq", doubles("", [[2.0]])),
                            ("name", matrix("", 4, (1, 3), element(4, "gyr".encode("utf-16-le"))))])
    gnss = structure("gnss", [("t", doubles("", [[t] for t in TIME[:4]])), ("lat", doubles("", [[34.0]] * 4))])
    header = b"MATLAB 5.0 MAT-file, Platform: GLNXA64".ljust(116) + bytes(8) + b"\0\1IM"
    put("navego.mat", header + b"".join(struct.pack("<II", 15, len(packed)) + packed for packed in map(zlib.compress, (imu, gnss))))
    rows = [TIME[:ROWS], RATE[:ROWS], TEMP[:ROWS]]
    put("rows.mat", header + doubles("data", rows) + doubles("time_s", [TIME[:ROWS]]))
    put("cut.mat", (header + doubles("data", rows) + doubles("time_s", [TIME[:ROWS]]))[:-40])
    bomb = matrix("time_s", 6, (1, 150_000_000), struct.pack("<II", 2, 150_000_000))  # states 143 MiB of zeros
    packer = zlib.compressobj(9)
    packed = packer.compress(struct.pack("<II", 14, len(bomb) - 8 + 150_000_000) + bomb[8:])
    packed += b"".join(packer.compress(bytes(1_000_000)) for _ in range(150)) + packer.flush()
    put("inflating.mat", header + struct.pack("<II", 15, len(packed)) + packed)


if __name__ == "__main__":
    excel()
    matlab()
