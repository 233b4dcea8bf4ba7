#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""The far end of an output of prismd, and readers of what leaves there.

out_reader.py tcp:PORT|accept:PORT|udp:PORT|pty:LINK FILE   stores what arrives; tcp connects again and again; accept waits for one
                                                connection; pty does not read for /dev/null
out_reader.py messages FILE                     prism's messages as lines: axis number time_s rate correction sd flags
out_reader.py capture FILE...                   the bytes in captures
"""
import os
import socket
import struct
import sys
import time
import tty
import zlib

MESSAGE = struct.Struct("<2sBBIqddfI")  # docs/wire.md


def messages(data):
    assert len(data) % (MESSAGE.size + 4) == 0, f"{len(data)} bytes are a number of messages and a part"
    for at in range(0, len(data), MESSAGE.size + 4):
        body, check = data[at:at + MESSAGE.size], data[at + MESSAGE.size:at + MESSAGE.size + 4]
        assert zlib.crc32(body) == int.from_bytes(check, "little"), f"wrong check at {at}"
        sync, version, *values = MESSAGE.unpack(body)
        assert (sync, version) == (b"PR", 1), f"no message at {at}"
        yield values


def capture(data):
    at = 24
    while at < len(data):
        size = int.from_bytes(data[at + 8:at + 12], "little")
        record = data[at + 16:at + 16 + size]
        at += 16 + size
        if record[8] == 2:  # data
            yield record[12:]


def receive(place, path):
    kind, where = place.split(":", 1)
    with open(path, "ab", buffering=0) as out:
        if kind == "pty":
            master, slave = os.openpty()
            tty.setraw(slave)
            if os.path.lexists(where):
                os.unlink(where)
            os.symlink(os.ttyname(slave), where)
            while path == "/dev/null":  # a reader that does not read
                time.sleep(60)
            while True:
                out.write(os.read(master, 65536))
        if kind == "udp":
            line = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
            line.bind(("127.0.0.1", int(where)))
            while True:
                out.write(line.recv(65536))
        if kind == "accept":
            with socket.create_server(("127.0.0.1", int(where))) as server, server.accept()[0] as line:
                while data := line.recv(65536):
                    out.write(data)
            return
        while True:
            try:
                with socket.create_connection(("127.0.0.1", int(where))) as line:
                    while data := line.recv(65536):
                        out.write(data)
            except OSError:
                pass
            time.sleep(0.02)


def main():
    if sys.argv[1] == "messages":
        for axis, number, time_ns, rate, correction, sd, flags in messages(open(sys.argv[2], "rb").read()):
            print(axis, number, f"{time_ns / 1e9:.4f}", f"{rate:.9g}", f"{correction:.9g}", f"{sd:.6g}", flags)
    elif sys.argv[1] == "capture":
        for name in sys.argv[2:]:
            for piece in capture(open(name, "rb").read()):
                sys.stdout.buffer.write(piece)
    else:
        receive(*sys.argv[1:])


if __name__ == "__main__":
    main()
