# SPDX-License-Identifier: MIT
"""Notifications and log pages of prismd. Names end with their unit; None is an unknown quantity."""

from dataclasses import dataclass, fields
from typing import Any, Dict, List, Optional, Type, TypeVar, Union

Row = TypeVar("Row")


def row_of(kind: Type[Row], params: Dict[str, Any]) -> Row:
    """Ignores members that a newer prismd adds; those that an older one does not send are None."""
    names = [field.name for field in fields(kind)]
    return kind(**{name: params.get(name) for name in names})


@dataclass(frozen=True)
class Window:
    """One second, and the means of the window that ends with it."""

    axis: Optional[str]  # name in the frame description
    time_s: float  # its end, seconds since 1970 UTC (clock "host")
    samples: int
    missing: int
    rate_deg_per_h: Optional[float]  # of the second
    temperature_degc: Optional[float]  # of the second
    uhfo_v: Optional[float]
    corrected_deg_per_h: Optional[float]
    mean_rate_deg_per_h: Optional[float]  # of the window
    corrected_mean_deg_per_h: Optional[float]
    mean_temperature_degc: Optional[float]
    slope_degc_per_s: Optional[float]
    mean_uhfo_v: Optional[float]
    bias_deg_per_h: Optional[float]
    sd_deg_per_h: Optional[float]  # of (true bias - this bias)
    sd_mean_deg_per_h: Optional[float]  # with the noise of the mean rate; None for models of version 0.1
    sent_deg_per_h: Optional[float]  # mean of the rates that the first output sent in the second
    offset_deg_per_h: Optional[float]  # by command, subtracted besides the bias; None: none
    quality: str
    sensors: Optional[Dict[str, Optional[float]]]  # means of the second by name; None: without sensors

    @property
    def good(self) -> bool:
        """True if the quality is `good`."""
        return self.quality == "good"


@dataclass(frozen=True)
class Sample:
    """One frame."""

    axis: Optional[str]
    time_s: float
    rate_deg_per_h: Optional[float]
    temperature_degc: Optional[float]
    uhfo_v: Optional[float]
    bias_deg_per_h: Optional[float]
    sd_deg_per_h: Optional[float]  # of (true bias - this bias)
    sd_mean_deg_per_h: Optional[float]  # with the noise of the mean rate; None for models of version 0.1
    corrected_deg_per_h: Optional[float]
    quality: str


@dataclass(frozen=True)
class Event:
    """An event of prismd."""

    time_s: float
    severity: str
    kind: str
    text: str
    repeats: Optional[int]


Value = Union[int, float, str, None]


@dataclass(frozen=True)
class LogPage:
    """Rows of the log, oldest first, and the cursor after the last one."""

    rows: List[Dict[str, Value]]  # by column name, with the segment number "segment" and the row number "row"
    cursor: str  # pass as `after` to continue, at any later time
    missing: int  # rows before the first one that were deleted or damaged before they were fetched
    more: bool  # further rows exist
    axis: str
    damaged: List[str]  # one text per row that is not in `rows` because its file was damaged: place, found, expected


_TEXTS = ("time_utc", "quality")


def _value(column: str, field: str) -> Value:
    if not field:
        return None
    if column in _TEXTS:
        return field
    return int(field) if field.lstrip("-").isdigit() else float(field)


def _values(columns: List[str], line: str) -> Dict[str, Value]:
    """Raises ValueError for a damaged row."""
    found = line.split(",")
    if len(found) != len(columns):
        raise ValueError(f"found {len(found)} fields, expected {len(columns)}")
    return {column: _value(column, field) for column, field in zip(columns, found)}


def page_of(axes: Dict[str, Any]) -> LogPage:
    """`axes`: of the result of `rows`, which has one."""
    (axis, answer), = axes.items()
    rows: List[Dict[str, Value]] = []
    damaged: List[str] = []
    for segment in answer["segments"]:
        columns = segment["columns"].split(",")
        for number, line in enumerate(segment["rows"], segment["first"]):
            try:
                rows.append({"segment": segment["segment"], "row": number, **_values(columns, line)})
            except ValueError as why:
                damaged.append(f"{segment['file']}, row {number}: {why}")
    return LogPage(rows, answer["after"], answer["missing"], answer["more"], axis, damaged)
