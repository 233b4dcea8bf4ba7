# SPDX-License-Identifier: MIT
# A proxy between the relay and PostgreSQL that can cut the connection. usage: cutting_proxy.py PORT SOCKET ORDER. If the file ORDER
# contains a number N, the proxy removes the file and resets the connection after N more bytes.
import os
import socket
import struct
import sys
import threading

port, target, order = int(sys.argv[1]), sys.argv[2], sys.argv[3]
left = None
lock = threading.Lock()


def ordered():
    global left
    with lock:
        if left is None and os.path.exists(order):
            text = open(order).read().strip()
            if text:
                left = int(text)
                os.unlink(order)


def allowed(size):
    """Returns how many of `size` bytes to pass on; if fewer than `size`, the connection is cut."""
    global left
    ordered()
    with lock:
        if left is None:
            return size
        passed, left = min(size, left), left - size
        if left <= 0:
            left = None
        return passed


def carry(source, sink):
    try:
        while data := source.recv(4096):
            passed = allowed(len(data))
            sink.sendall(data[:passed])
            if passed < len(data):
                break
    except OSError:
        pass
    for end in (source, sink):
        try:
            if end.family == socket.AF_INET:  # closes with a reset
                end.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
            end.shutdown(socket.SHUT_RDWR)
        except OSError:
            pass
        end.close()


listener = socket.create_server(("127.0.0.1", port))
while True:
    client, _ = listener.accept()
    server = socket.socket(socket.AF_UNIX)
    try:
        server.connect(target)
    except OSError:
        client.close()
        continue
    for pair in ((client, server), (server, client)):
        threading.Thread(target=carry, args=pair, daemon=True).start()
