# SPDX-License-Identifier: MIT
"""One connection to prismd's socket: JSON-RPC 2.0, one JSON value per line."""

import errno
import json
import os
import socket
from collections import deque
from typing import Any, Deque, Dict, List, Optional

ANSWER_TIMEOUT_S = 10.0


class PrismError(Exception):
    """Base class: a request to prismd failed."""


class Gone(PrismError):
    """No prismd answers, or the connection was closed."""


class Refused(PrismError):
    """prismd returned an error; `code` and `data` as in prism-protocol(7)."""

    def __init__(self, message: str, code: int, data: Any = None) -> None:
        super().__init__(message)
        self.code = code
        self.data = data


def _folders() -> List[str]:
    own = os.environ.get("XDG_RUNTIME_DIR") or f"/run/user/{os.geteuid()}"
    return ["/run/prismd", os.path.join(own, "prismd")]


def _connect(path: str) -> socket.socket:
    link = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
    link.settimeout(ANSWER_TIMEOUT_S)
    try:
        link.connect(path)
    except OSError:
        link.close()
        raise
    return link


def would_start(path: str) -> bool:
    """True if systemd listens for the stopped instance: a connection would start it."""
    folder, name = os.path.split(path)
    activated = os.path.islink(os.path.join(folder, "activated", name))
    return activated and not os.path.exists(os.path.join(folder, "running", name[:-5]))


def running_sockets() -> Dict[str, str]:
    """Name → socket path of all instances that run or that systemd starts on connection. Starts none. Includes running
    instances without permission to connect."""
    found: Dict[str, str] = {}
    for folder in _folders():
        try:
            names = sorted(os.listdir(folder))
        except OSError:
            continue
        for name in names:
            path = os.path.join(folder, name)
            if not name.endswith(".sock") or name[:-5] in found:
                continue
            if would_start(path):
                found[name[:-5]] = path
                continue
            try:
                _connect(path).close()
            except OSError as why:
                if why.errno != errno.EACCES:
                    continue
            found[name[:-5]] = path
    return found


def find_socket(name: Optional[str], path: Optional[str]) -> str:
    """As in prismctl: `path`, else $PRISM_SOCKET if no name is given, else the named instance, else the only one."""
    if path:
        return path
    if not name and os.environ.get("PRISM_SOCKET"):
        return os.environ["PRISM_SOCKET"]
    running = running_sockets()
    if name and name in running:
        return running[name]
    if not running:
        raise Gone(f"{', '.join(_folders())}: no prismd answers here")
    if not name and len(running) == 1:
        return next(iter(running.values()))
    raise PrismError(f"found {name!r}, expected one of: {', '.join(running)}")


class Connection:
    """Requests and notifications over one socket. Raises Gone on every connection error."""

    def __init__(self, path: str) -> None:
        self.path = path
        try:
            self._link = _connect(path)
        except OSError as why:
            raise Gone(f"{path}: no prismd answers: {why.strerror or why}") from why
        self._pending = b""
        self._notifications: Deque[Dict[str, Any]] = deque()
        self._last_id = 0

    def close(self) -> None:
        self._link.close()

    def _message(self, timeout_s: Optional[float]) -> Dict[str, Any]:
        while b"\n" not in self._pending:
            try:
                self._link.settimeout(timeout_s)
                more = self._link.recv(65536)
            except socket.timeout as why:
                raise Gone(f"{self.path}: no answer within {timeout_s:g} s") from why
            except OSError as why:
                raise Gone(f"{self.path}: {why.strerror or why}") from why
            if not more:
                raise Gone(f"{self.path}: prismd closed the connection")
            self._pending += more
        line, self._pending = self._pending.split(b"\n", 1)
        message = json.loads(line)
        if not isinstance(message, dict):
            raise PrismError(f"{self.path}: found no JSON object, expected prismd's socket")
        return message

    def ask(self, method: str, params: Optional[Dict[str, Any]] = None) -> Any:
        """Returns the result. Queues notifications that arrive meanwhile for notification()."""
        self._last_id += 1
        request: Dict[str, Any] = {"jsonrpc": "2.0", "id": self._last_id, "method": method, "protocol": 2}
        if params is not None:
            request["params"] = params
        try:
            self._link.settimeout(ANSWER_TIMEOUT_S)
            self._link.sendall(json.dumps(request).encode() + b"\n")
        except OSError as why:
            raise Gone(f"{self.path}: {why.strerror or why}") from why
        while True:
            message = self._message(ANSWER_TIMEOUT_S)
            if "method" in message:
                self._notifications.append(message)
            elif message.get("id") is None and "error" in message:  # prismd rejects the connection
                raise Gone(f"{self.path}: {message['error']['message']}")
            elif message.get("id") == self._last_id:
                if "error" in message:
                    raise Refused(message["error"]["message"], message["error"]["code"], message["error"].get("data"))
                return message["result"]

    def notification(self, timeout_s: Optional[float] = None) -> Dict[str, Any]:
        """The next one: {"method": …, "params": …}. Raises Gone after `timeout_s`; None waits without limit."""
        while not self._notifications:
            message = self._message(timeout_s)
            if "method" in message:
                return message
        return self._notifications.popleft()
