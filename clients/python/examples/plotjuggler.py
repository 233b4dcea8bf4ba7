#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Sends a gyro's rows to PlotJuggler: UDP Server, protocol JSON, "use field timestamp". A curve is GYRO/AXIS/window/NAME."""

import argparse
import dataclasses
import json
import socket

import prism

parser = argparse.ArgumentParser(description=__doc__)
parser.add_argument("gyro", nargs="?", help="instance; default: the only running one")
parser.add_argument("--to", default="127.0.0.1:9870", metavar="HOST:PORT", help="default: %(default)s")
parser.add_argument("--every", type=int, metavar="N", help="every N-th frame (GYRO/AXIS/sample/NAME) instead of seconds")
options = parser.parse_args()
host, port = options.to.rsplit(":", 1)
family, kind, protocol, _, address = socket.getaddrinfo(host.strip("[]"), port, type=socket.SOCK_DGRAM)[0]
gyro = prism.Gyro(options.gyro)
name, stream = gyro.status()["name"], "sample" if options.every else "window"
with socket.socket(family, kind, protocol) as link:
    for row in gyro.samples(options.every) if options.every else gyro.rows():
        values = {key: value for key, value in dataclasses.asdict(row).items() if value is not None}
        values.pop("axis"), values.pop("time_s")
        try:
            link.sendto(json.dumps({name: {row.axis: {stream: values}}, "timestamp": row.time_s}).encode(), address)
        except OSError:
            pass  # no receiver, or a full buffer: later rows may arrive
