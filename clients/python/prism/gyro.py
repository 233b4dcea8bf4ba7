# SPDX-License-Identifier: MIT
"""The gyro of one prismd instance."""

import time
from typing import Any, Dict, Iterator, List, Optional, Type, TypeVar

from ._connection import Connection, Gone, PrismError, Refused, find_socket
from .rows import Event, LogPage, Sample, Window, page_of, row_of

Row = TypeVar("Row")
RETRY_S = 0.5
ROWS_GONE = -32007
HISTORY_S = 3600
WAIT_S = 5.0  # less than ANSWER_TIMEOUT_S


def _chosen(axis: Optional[str]) -> Dict[str, Any]:
    return {"axis": axis} if axis else {}


def _axes(result: Dict[str, Any]) -> Dict[str, Any]:
    """The parts of a result by axis."""
    if "axes" not in result:
        raise PrismError("found a response of protocol 1, expected 2: this prismd is older; restart it")
    return dict(result["axes"])


def _only(result: Dict[str, Any]) -> Any:
    """The part of the only axis; of several, all by name."""
    axes = _axes(result)
    return next(iter(axes.values())) if len(axes) == 1 else axes


def _in_time(history: Dict[str, Any]) -> List[Dict[str, Any]]:
    """The rows of all axes in order of time."""
    return sorted((row for rows in _axes(history).values() for row in rows), key=lambda row: row["time_s"])


class Gyro:
    """Requests connect when needed, and reconnect once if prismd was restarted.

    `name`: instance; None: the only running one. `path`: socket to use instead.
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
        """Calls a method of prism-protocol(7). Raises Gone if no prismd answers, Refused if it returns an error."""
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
        """The members of an axis are in "axes"; of a device with one axis also in the result itself."""
        status = dict(self.ask("status"))
        axes = _axes(status)
        if len(axes) == 1:
            axis, own = next(iter(axes.items()))
            log = {**(status.get("log") or {}), **own.get("log", {})}
            status.update({**own, "axis": axis, **({"log": log} if log else {})})
        return status

    def bias(self, axis: Optional[str] = None) -> Dict[str, Any]:
        """For a device of several axes without `axis`: all, by name."""
        return dict(_only(self.ask("bias", **_chosen(axis))))

    def stability(self, axis: Optional[str] = None) -> Dict[str, Any]:
        return dict(_only(self.ask("stability", **_chosen(axis))))

    def history(self, seconds: int = 100, axis: Optional[str] = None) -> List[Window]:
        """The last rows of each axis, or of one, oldest first; at most an hour."""
        return [row_of(Window, row) for row in _in_time(self.ask("history", seconds=seconds, **_chosen(axis)))]

    def log(self, after: str = "", *, axis: Optional[str] = None, follow: bool = False) -> Iterator[LogPage]:
        """Yields pages of log rows after the cursor `after` ("": from the earliest row) to the end; with `follow` without end,
        also after restarts of prismd. Returns only rows on disk, each once, and counts deleted
        and damaged ones: if no row follows them, in a page without rows. Store page.cursor
        after you have stored the page. Raises Refused for a cursor of another log or past its end."""
        cursor = after
        while True:
            params: Dict[str, Any] = {**_chosen(axis), "wait_s": WAIT_S if follow else 0, "limit": 2000}
            if cursor:
                params["after"] = cursor
            try:
                page = page_of(_axes(self.ask("rows", **params)))
            except Refused as why:
                if why.code != ROWS_GONE:
                    raise
                page = page_of(_axes(why.data))
            except Gone:
                if not follow:
                    raise
                time.sleep(RETRY_S)
                continue
            cursor = page.cursor
            if page.rows or page.missing:
                yield page
            if not follow and not page.more:
                break

    def rows(self, axes: Optional[List[str]] = None, *, reconnect: bool = True) -> Iterator[Window]:
        """Yields one row per second of each axis, or of `axes`, from now on. Waits while prismd is stopped. If only the
        connection was lost, yields the missed rows first (up to an hour). `reconnect=False`: raises Gone instead."""
        last_s: Dict[Optional[str], float] = {}
        started_s: Optional[float] = None
        subscription = {"streams": ["window"], **({"axes": axes} if axes else {})}
        for connection in self._connections(reconnect):
            try:
                connection.ask("subscribe", subscription)
                now_started_s = connection.ask("status")["started_s"]
                if last_s:
                    since_s = last_s if now_started_s == started_s else {}  # prismd restarted: all its rows
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
                        continue  # already in the history
                    first.pop(axis, None)
                    last_s[axis] = params["time_s"]
                    yield row_of(Window, params)
            except Gone:
                if not reconnect:
                    raise

    def samples(
        self, every: int = 1, axes: Optional[List[str]] = None, *, reconnect: bool = True
    ) -> Iterator[Sample]:
        """Yields every n-th frame of each axis, or of `axes`, from now on."""
        subscription = {"streams": ["sample"], "every": every, **({"axes": axes} if axes else {})}
        return self._follow(Sample, "sample", subscription, reconnect)

    def events(self, *, reconnect: bool = True) -> Iterator[Event]:
        """Yields events, from now on."""
        return self._follow(Event, "event", {"streams": ["event"]}, reconnect)

    def _open(self) -> Connection:
        return Connection(find_socket(self._name, self._path))

    def _connections(self, reconnect: bool) -> Iterator[Connection]:
        """Yields a new connection after each loss."""
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
