#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
# Simulated instruments that answer only when asked, on a pseudo-terminal. usage: instrument.py scpi|modbus|weiss LINK [mute|rubbish]
# scpi: MEAS:TEMP? as SCPI-1999; modbus: 8PT1000, function 3 with CRC16; weiss: SIMCON/32, ASCII-2. Values rise by 0.1 degC a request.
# mute: every third request gets no reply. rubbish: sends random bytes for ever. Prints the time of each request.
import os
import pty
import random
import select
import sys
import termios
import time


def crc16(data):
    crc = 0xFFFF
    for byte in data:
        crc ^= byte
        for _ in range(8):
            crc = (crc >> 1) ^ (0xA001 if crc & 1 else 0)
    return crc.to_bytes(2, "little")


def reply_scpi(heard, value):
    if not heard.endswith(b"MEAS:TEMP?\n"):
        return None
    return f"{value:+.8E}\r\n".encode()


def reply_modbus(heard, value):
    if len(heard) < 8 or crc16(heard[-8:-2]) != heard[-2:]:
        return None
    address, function, first, count = heard[-8], heard[-7], int.from_bytes(heard[-6:-4], "big"), int.from_bytes(heard[-4:-2], "big")
    if (address, function) != (1, 3):
        return None
    values = b"".join(round(10 * value + n).to_bytes(2, "big", signed=True) for n in range(first, first + count))
    body = bytes([address, function, len(values)]) + values
    return body + crc16(body)


def reply_weiss(heard, value):
    if not heard.endswith(b"$00I\r"):
        return None
    numbers = [23, value, 50, 41, 80, 80, 0, 20.1, 0, 20.2, 0, 20.3, 0, 20.4]
    return (" ".join(f"{n:06.1f}" for n in numbers) + " 01101010101010101010101010101010\r").encode()


def main():
    kind, link = sys.argv[1:3]
    habit = sys.argv[3] if len(sys.argv) > 3 else ""
    reply_to = {"scpi": reply_scpi, "modbus": reply_modbus, "weiss": reply_weiss}[kind]
    master, slave = pty.openpty()
    mode = termios.tcgetattr(slave)
    mode[0] = mode[1] = mode[3] = 0
    termios.tcsetattr(slave, termios.TCSANOW, mode)
    if os.path.islink(link):
        os.unlink(link)
    os.symlink(os.ttyname(slave), link)
    os.set_blocking(master, False)
    heard, count = b"", 0
    while True:
        ready = select.select([master], [], [], 0.01 if habit == "rubbish" else None)[0]
        if habit == "rubbish":
            try:
                os.write(master, random.randbytes(200))
            except BlockingIOError:
                pass
        if not ready:
            continue
        for byte in os.read(master, 4096):
            heard = (heard + bytes([byte]))[-256:]
            reply = reply_to(heard, 20 + 0.1 * count)
            if reply is None:
                continue
            heard = b""
            count += 1
            print(f"{time.time():.3f}", flush=True)
            if habit == "mute" and count % 3 == 0:
                continue
            for part in (reply[:3], reply[3:]):  # a reply in two parts
                os.write(master, part)
                time.sleep(0.002)


if __name__ == "__main__":
    main()
