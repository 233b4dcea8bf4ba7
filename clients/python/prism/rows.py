# SPDX-License-Identifier: MIT
"""What prismd notifies: rows with units in their names; None is a quantity that is not known."""

from dataclasses import dataclass, fields
from typing import Any, Dict, Optional, Type, TypeVar

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
