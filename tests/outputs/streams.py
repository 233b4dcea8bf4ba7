#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
# Replays the streams of a page, each of a packet a second. usage: streams.py PAGE (streams.txt). A line of the page:
# `config {...}`, `base {...}`: the configuration, the frame description. `frame AA55 >Bhb 2`: the frame 7:100:20 is these bytes, the numbers
# in this format of Python's struct, and their sum in two bytes. `> 7..9:100:20 8:1:2 open`: packets, first three frames with n from 7 and rate
# from 100. 7:1:2[3:] is a part of a frame, ^3 changes the lowest bit of byte 3, x00FF are bytes, + joins parts, @5 sets the time of the next
# packet, `open` is an opened line. Prints counts, what --sniff prints, and rows: second, samples, missing, rate, temperature, status, quality,
# partial, without status, quality and partial if usual. `$ command`: its output.
import glob
import json
import re
import shutil
import struct
import subprocess
import sys


def piece(text, form):
    if text.startswith("x"):
        return bytes.fromhex(text[1:])
    sync, layout, size = form.split()
    numbers, begin, end, flip = re.fullmatch(r"([-\d:]+?)(?:\[(\d*):(\d*)\])?(?:\^(\d+))?", text).groups()
    data = bytearray.fromhex(sync) + struct.pack(layout, *map(int, numbers.split(":")))
    data += (sum(data) % 256 ** int(size)).to_bytes(int(size), "big")
    if flip:
        data[int(flip)] ^= 1
    return data[int(begin or 0):int(end or len(data))]


def spread(match):  # 7..9:100:20
    return " ".join(f"{n}:{int(match[3]) + n - int(match[1])}{match[4]}" for n in range(int(match[1]), int(match[2]) + 1))


def capture(text, form):
    at, out = 1000.0, struct.pack("<IHHIIII", 0xA1B23C4D, 2, 4, 0, 0, 65535, 250)
    for word in re.sub(r"(\d+)\.\.(\d+):(-?\d+)(\S*)", spread, text).split():
        if word.startswith("@"):
            at = 1000 + float(word[1:])
            continue
        data = b"" if word == "open" else b"".join(piece(part, form) for part in word.split("+"))
        time = divmod(round(at * 1e6), 1000000)
        out += struct.pack("<IIII", time[0], time[1] * 1000, 12 + len(data), 12 + len(data))
        out += struct.pack(">IIBBH", *time, 0 if word == "open" else 2, 0, 0) + data
        at += 1
    return out


def printed(*command):
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    text = re.sub(r" in \S+ s \(.*?\)|log: .*|bias stab.*|^\S+Z |input.pcap: \w+$|; prismd --sniff.*|, \S+ Hz", "", done.stdout + done.stderr, flags=re.M)
    print(*("  " + line.strip() for line in text.split("\n") if line.strip()), sep="\n")


form = None
for line in open(sys.argv[1], encoding="utf-8").read().rstrip("\n").split("\n"):
    word, _, rest = line.partition(" ")
    print(line)
    if word in ("config", "base"):
        with open(f"{word}.json", "w", encoding="utf-8") as file:
            json.dump(json.loads(rest), file)
    elif word == "frame":
        form = rest
    elif word == "$":
        printed("bash", "-c", rest)
    elif word == ">":
        with open("input.pcap", "wb") as file:
            file.write(capture(rest, form))
        shutil.rmtree("log", ignore_errors=True)
        printed("prismd", "config.json", "--replay", "input.pcap", "--out", "log")
        printed("prismd", "--sniff", "input.pcap", "./base.json")
        rows = [row.rstrip().split(",") for name in sorted(glob.glob("log/*.csv")) for row in open(name, encoding="utf-8") if row[:4].isdigit()]
        shown = (" ".join([*row[1:6], row[7], row[16], row[21]]).replace(" 0 no_model 0", "").rstrip() for row in rows)
        print("  rows: " + " | ".join(shown) if rows else "  no row")
