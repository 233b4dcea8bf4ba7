# SPDX-License-Identifier: MIT
"""A gyro as prismd serves it."""

import time
from typing import Any, Dict, Iterator, List, Optional, Type, TypeVar

from ._connection import Connection, Gone, find_socket
from .rows import Event, LogPage, Sample, Window, page_of, row_of

Row = TypeVar("Row")
RETRY_S = 0.5
HISTORY_S = 3600
WAIT_S = 5.0  # below what a connection waits for an answer


def _chosen(axis: Optional[str]) -> Dict[str, Any]:
    return {"axis": axis} if axis else {}


def _in_time(history: Any) -> List[Dict[str, Any]]:
    """The answer `history` of one axis is a list, of several an object of them by name."""
    if isinstance(history, list):
        return history
    return sorted((row for axis in history.values() for row in axis), key=lambda row: row["time_s"])


class Gyro:
    """Questions open the connection when they need it, and once again where prismd was restarted in between.

    `name`: of the instance; none: the only one that runs. `path`: of the socket, instead.
    """

    def __init__(self, name: Optional[str] = None, *, path: Optional[str] = None) -> None:
        self._name, self._path = name, path
        self._connection: Optional[Connection] = None

    def __enter__(self) -> "Gyro":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        if self._connection:
            self._connection.close()
        self._connection = None

    def ask(self, method: str, **params: Any) -> Any:
        """Any method of prism-protocol(7). Gone where no prismd answers, Refused where it refuses."""
        for again in (True, False):
            known = self._connection is not None
            try:
                if self._connection is None:
                    self._connection = self._open()
                return self._connection.ask(method, params or None)
            except Gone:
                self.close()
                if not (known and again):
                    raise
        raise AssertionError("unreachable")

    def status(self) -> Dict[str, Any]:
        return dict(self.ask("status"))

    def bias(self, axis: Optional[str] = None) -> Dict[str, Any]:
        """Of a device of several axes without `axis`: of all, by name."""
        return dict(self.ask("bias", **_chosen(axis)))

    def stability(self, axis: Optional[str] = None) -> Dict[str, Any]:
        return dict(self.ask("stability", **_chosen(axis)))

    def history(self, seconds: int = 100, axis: Optional[str] = None) -> List[Window]:
        """The last rows of each axis, or of one, oldest first; at most an hour."""
        return [row_of(Window, row) for row in _in_time(self.ask("history", seconds=seconds, **_chosen(axis)))]

    def log(
        self, after: str = "", *, axis: Optional[str] = None, name: Optional[str] = None, follow: bool = False
    ) -> Iterator[LogPage]:
        """Pages of the log's rows behind a cursor, from the earliest on without one, to the end; with `follow` for ever,
        over restarts of prismd. Only what is on the disk, each row once; what was deleted meanwhile is counted. Keep
        page.cursor once the page is safe. `name`: prismd keeps the place, as far as pages were taken; it belongs to
        the user. Refused: a cursor of another log, or beyond its end."""
        cursor = after
        while True:
            params: Dict[str, Any] = {**_chosen(axis), "wait_s": WAIT_S if follow else 0, "limit": 2000}
            params.update({key: value for key, value in (("after", cursor), ("name", name)) if value})
            try:
                page = page_of(self.ask("rows", **params))
            except Gone:
                if not follow:
                    raise
                time.sleep(RETRY_S)
                continue
            cursor = page.cursor
            if page.rows:
                yield page
            if not follow and not page.more:
                break
        if name:  # the last page was taken, too
            self.ask("rows", **{**_chosen(axis), "after": cursor, "name": name, "limit": 1})

    def rows(self, axes: Optional[List[str]] = None, *, reconnect: bool = True) -> Iterator[Window]:
        """A row a second of each axis, or of those named, from now on. While prismd is away it is waited for; what it
        measured while only the connection was lost (up to an hour) is handed over first. `reconnect=False`: Gone
        instead."""
        last_s: Dict[Optional[str], float] = {}
        started_s: Optional[float] = None
        subscription = {"streams": ["window"], **({"axes": axes} if axes else {})}
        for connection in self._connections(reconnect):
            try:
                connection.ask("subscribe", subscription)
                now_started_s = connection.ask("status")["started_s"]
                if last_s:
                    since_s = last_s if now_started_s == started_s else {}  # a new prismd: all that it has
                    last_s = dict(since_s)
                    for params in _in_time(connection.ask("history", {"seconds": HISTORY_S})):
                        axis = params.get("axis")
                        if axes and axis not in axes or params["time_s"] <= since_s.get(axis, float("-inf")):
                            continue
                        last_s[axis] = params["time_s"]
                        yield row_of(Window, params)
                first, started_s = dict(last_s), now_started_s
                while True:
                    message = connection.notification()
                    params = message["params"]
                    axis = params.get("axis")
                    if message["method"] != "window" or params["time_s"] <= first.get(axis, float("-inf")):
                        continue  # it stood in the history
                    first.pop(axis, None)
                    last_s[axis] = params["time_s"]
                    yield row_of(Window, params)
            except Gone:
                if not reconnect:
                    raise

    def samples(
        self, every: int = 1, axes: Optional[List[str]] = None, *, reconnect: bool = True
    ) -> Iterator[Sample]:
        """Every n-th frame of each axis, or of those named, from now on."""
        subscription = {"streams": ["sample"], "every": every, **({"axes": axes} if axes else {})}
        return self._follow(Sample, "sample", subscription, reconnect)

    def events(self, *, reconnect: bool = True) -> Iterator[Event]:
        """What happens, from now on."""
        return self._follow(Event, "event", {"streams": ["event"]}, reconnect)

    def _open(self) -> Connection:
        return Connection(find_socket(self._name, self._path))

    def _connections(self, reconnect: bool) -> Iterator[Connection]:
        """One after the other, each of the follower's own."""
        while True:
            try:
                connection = self._open()
            except Gone:
                if not reconnect:
                    raise
            else:
                try:
                    yield connection
                finally:
                    connection.close()
            time.sleep(RETRY_S)

    def _follow(self, kind: Type[Row], method: str, subscription: Dict[str, Any], reconnect: bool) -> Iterator[Row]:
        for connection in self._connections(reconnect):
            try:
                connection.ask("subscribe", subscription)
                while True:
                    message = connection.notification()
                    if message["method"] == method:
                        yield row_of(kind, message["params"])
            except Gone:
                if not reconnect:
                    raise
