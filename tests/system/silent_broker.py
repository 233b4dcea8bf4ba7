# SPDX-License-Identifier: MIT
# Fake MQTT broker (3.1.1): accepts connections and pings, and acknowledges messages only while the file ACKNOWLEDGE exists.
# silent_broker.py PORT ACKNOWLEDGE: prints "connected" for each connection.
import os, socketserver, sys


class Client(socketserver.BaseRequestHandler):
    def read(self, size):
        data = b""
        while len(data) < size:
            part = self.request.recv(size - len(data))
            if not part:
                raise EOFError
            data += part
        return data

    def handle(self):
        try:
            while True:
                head, size, shift = self.read(1)[0], 0, 0
                while True:
                    byte = self.read(1)[0]
                    size += (byte & 127) << shift
                    shift += 7
                    if byte < 128:
                        break
                body = self.read(size)
                kind = head >> 4
                if kind == 1:  # CONNECT
                    print("connected", flush=True)
                    self.request.sendall(b"\x20\x02\x00\x00")
                elif kind == 3 and os.path.exists(sys.argv[2]):  # PUBLISH with QoS 1: PUBACK
                    topic = int.from_bytes(body[:2], "big")
                    self.request.sendall(b"\x40\x02" + body[2 + topic:4 + topic])
                elif kind == 8:  # SUBSCRIBE: SUBACK
                    self.request.sendall(b"\x90\x03" + body[:2] + b"\x01")
                elif kind == 12:  # PINGREQ
                    self.request.sendall(b"\xd0\x00")
        except (EOFError, ConnectionError):
            pass


class Server(socketserver.ThreadingMixIn, socketserver.TCPServer):
    daemon_threads = allow_reuse_address = True


Server(("127.0.0.1", int(sys.argv[1])), Client).serve_forever()
