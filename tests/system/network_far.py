# SPDX-License-Identifier: MIT
# The device's end of a line, for network_faults.py: a pseudo-terminal, TCP and UDP. plug() switches it on, unplug() off.
import os
import pty
import select
import socket
import termios


class Tty:
    """A pseudo-terminal behind a link; unplugged: no link, master closed."""

    def __init__(self, case, name, port):
        self.link = f"{case.folder}/{name}"
        self.settings = {"device": self.link}
        self.fd = None

    def plug(self):
        self.fd, slave = pty.openpty()
        mode = termios.tcgetattr(slave)
        mode[0] = mode[1] = mode[3] = 0
        termios.tcsetattr(slave, termios.TCSANOW, mode)
        self.slave = slave
        os.set_blocking(self.fd, False)
        os.symlink(os.ttyname(slave), self.link)

    def unplug(self):
        os.unlink(self.link)
        os.close(self.slave)
        os.close(self.fd)
        self.fd = None

    def send(self, data):
        os.write(self.fd, data)

    def receive(self):
        return os.read(self.fd, 4096) if select.select([self.fd], [], [], 0)[0] else b""

    def connections(self):
        return 1


class Tcp:
    """prismd connects (far end listens), or the far end connects (prismd listens)."""

    def __init__(self, case, name, port, listens):
        self.address, self.port, self.listens = case.far_address, port, listens
        if listens:
            self.settings = {"tcp": {"listen": f"{case.near_address}:{port}"}}
        else:
            self.settings = {"tcp": {"address": f"{case.far_name or case.far_address}:{port}"}}
        self.near = case.near_address
        self.listener = self.socket = None

    def plug(self):
        if self.listens:
            return
        self.listener = socket.socket()
        self.listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        self.listener.bind((self.address, self.port))
        self.listener.listen(8)
        self.listener.setblocking(False)

    def unplug(self, with_fin=True):
        for one in (self.socket, self.listener):
            if one:
                one.close()
        self.socket = self.listener = None

    def open_now(self):
        try:
            if self.listener:
                while True:  # the last connection is the current one
                    new, _ = self.listener.accept()
                    if self.socket:
                        self.socket.close()
                    self.socket = new
                    self.socket.setblocking(False)
            elif self.listens and not self.socket:
                new = socket.create_connection((self.near, self.port), 0.5)
                new.setblocking(False)
                self.socket = new
        except OSError:
            pass

    def send(self, data):
        self.open_now()
        if not self.socket:
            raise OSError("no connection")
        try:
            self.socket.sendall(data)
        except OSError:
            self.socket.close()
            self.socket = None
            raise

    def receive(self):
        self.open_now()
        try:
            data = self.socket.recv(4096) if self.socket else b""
        except BlockingIOError:
            return b""
        except OSError:
            data = b""
        if not data and self.socket:
            self.socket.close()
            self.socket = None
        return data


class Udp:
    def __init__(self, case, name, port):
        self.to = (case.near_address, port)
        self.settings = {"udp": {"listen": f"{case.near_address}:{port}", "from": f"{case.far_address}:{port + 1000}"}}
        self.own = (case.far_address, port + 1000)
        self.socket = None

    def plug(self):
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.bind(self.own)
        self.socket.setblocking(False)

    def unplug(self):
        self.socket.close()
        self.socket = None

    def send(self, data):
        self.socket.sendto(data, self.to)

    def receive(self):
        try:
            return self.socket.recv(4096)
        except OSError:
            return b""
