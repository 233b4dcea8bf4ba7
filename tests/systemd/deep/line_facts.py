# SPDX-License-Identifier: MIT
# Prints the speed of a serial device (termios2) and whether its driver has the low-latency flag.
import fcntl
import os
import struct
import sys

TCGETS2, TIOCGSERIAL, ASYNC_LOW_LATENCY = 0x802C542A, 0x541E, 0x2000
line = os.open(sys.argv[1], os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
speed = struct.unpack("4I20B2I", fcntl.ioctl(line, TCGETS2, bytes(44)))[-1]
flags = struct.unpack_from("iiIii", fcntl.ioctl(line, TIOCGSERIAL, bytes(72)))[4]
print(speed, "low_latency" if flags & ASYNC_LOW_LATENCY else "flags %#x" % flags)
