# SPDX-License-Identifier: MIT
"""What prismd notifies: rows with units in their names; None is a quantity that is not known."""

from dataclasses import dataclass, fields
from typing import Any, Dict, List, Optional, Type, TypeVar, Union

Row = TypeVar("Row")


def row_of(kind: Type[Row], params: Dict[str, Any]) -> Row:
    """Members that a newer prismd sends are left out; those that an older one does not send are None."""
    names = [field.name for field in fields(kind)]
    return kind(**{name: params.get(name) for name in names})


@dataclass(frozen=True)
class Window:
    """One second, and the means of the window that it completes."""

    axis: Optional[str]  # as the frame description names it; None: a prismd before 0.2
    time_s: float  # its end, seconds since 1970 UTC (clock "host")
    samples: int
    missing: int
    rate_deg_per_h: Optional[float]  # of the second
    temperature_degc: Optional[float]  # of the second; None also for a prismd before 0.2
    uhfo_v: Optional[float]
    corrected_deg_per_h: Optional[float]
    mean_rate_deg_per_h: Optional[float]  # of the window
    corrected_mean_deg_per_h: Optional[float]
    mean_temperature_degc: Optional[float]
    slope_degc_per_s: Optional[float]
    mean_uhfo_v: Optional[float]
    bias_deg_per_h: Optional[float]
    sd_deg_per_h: Optional[float]  # of the true bias less this one
    sd_mean_deg_per_h: Optional[float]  # with the noise of the mean rate; None for models of version 0.1
    quality: str
    sensors: Optional[Dict[str, Optional[float]]]  # means of the second by name; None: there are none

    @property
    def good(self) -> bool:
        """A correction without reservation."""
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
    sd_deg_per_h: Optional[float]  # of the true bias less this one
    sd_mean_deg_per_h: Optional[float]  # with the noise of the mean rate; None for models of version 0.1
    corrected_deg_per_h: Optional[float]
    quality: str


@dataclass(frozen=True)
class Event:
    """What happened."""

    time_s: float
    severity: str
    kind: str
    text: str
    repeats: Optional[int]


Value = Union[int, float, str, None]


@dataclass(frozen=True)
class LogPage:
    """Rows of the log, oldest first, and the place behind the last one."""

    rows: List[Dict[str, Value]]  # by the names of the log's columns, and "segment", "row", which count its rows
    cursor: str  # what `after` takes to go on, in years, too
    missing: int  # rows before the first one that were deleted before they were fetched
    more: bool  # others wait
    axis: str


def _value(field: str) -> Value:
    if not field:
        return None
    for kind in (int, float):
        try:
            return kind(field)
        except ValueError:
            pass
    return field


def page_of(answer: Dict[str, Any]) -> LogPage:
    rows: List[Dict[str, Value]] = []
    for segment in answer["segments"]:
        columns = segment["columns"].split(",")
        for number, line in enumerate(segment["rows"], segment["first"]):
            row: Dict[str, Value] = {"segment": segment["segment"], "row": number}
            row.update(zip(columns, map(_value, line.split(","))))
            rows.append(row)
    return LogPage(rows, answer["after"], answer["missing"], answer["more"], answer["axis"])
