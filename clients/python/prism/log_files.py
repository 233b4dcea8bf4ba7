# SPDX-License-Identifier: MIT
"""Logs on disk as pandas DataFrames."""

import glob
import os
from typing import Any, Dict, List, Optional, Sequence, Tuple

# The last part of a column's name is its unit; the longest first.
UNITS = [("deg_per_h", "deg/h"), ("degc_per_s", "degC/s"), ("degc", "degC"), ("ma", "mA"), ("pa", "Pa"), ("s", "s"), ("v", "V"), ("a", "A"), ("g", "g")]


def read_header(path: str) -> Tuple[Dict[str, str], List[str]]:
    """The metadata of a segment and the names of its columns."""
    metadata: Dict[str, str] = {}
    with open(path, encoding="utf-8") as file:
        for line in file:
            if not line.startswith("#"):
                return metadata, line.rstrip("\n").split(",")
            key, _, value = line[2:].rstrip("\n").partition(": ")
            metadata.setdefault(key, value)
    raise ValueError(f"{path}: found no line of columns")


def read_log(folder: str, axis: Optional[str] = None, columns: Optional[Sequence[str]] = None) -> Any:
    """The rows of one axis as a pandas DataFrame, with their times (UTC) as index.

    `folder`: the directory of the segments. `axis`: required if it has several. `columns`: names of the columns to read; a year of
    one column needs 0.9 GB, each further one 0.3 GB. `attrs` has "units", by column, and the metadata of the first segment. Rows
    that a later segment repeats (supersedes) are left out. Raises ValueError.
    """
    import numpy  # both only if they are used
    import pandas

    segments = [(path, *read_header(path)) for path in sorted(glob.glob(os.path.join(glob.escape(folder), "*.csv")))]
    axes = sorted({metadata.get("axis", "-") for _, metadata, _ in segments})
    if axis is None and len(axes) != 1:
        raise ValueError(f"{folder}: found the axes {', '.join(axes) or 'of no log'}, expected one: read_log(folder, axis=…)")
    segments = [segment for segment in segments if axis is None or segment[1].get("axis", "-") == axis]
    if not segments:
        raise ValueError(f"{folder}: found no axis {axis}, expected one of {', '.join(axes)}")
    repeats = [metadata["supersedes"].partition(" from row ") for _, metadata, _ in segments if "supersedes" in metadata]
    kept = {name: int(first) - 1 for name, _, first in repeats}  # rows of a segment that a later one does not repeat
    every = dict.fromkeys(name for _, _, names in segments for name in names if name != "time_utc")
    wanted = [name for name in every if columns is None or name in ("time_s", *columns)]
    joined = {name: numpy.empty(0, "datetime64[ns]" if name == "time_s" else "float64") for name in wanted}
    qualities = []
    for path, _, _ in segments:
        rows = pandas.read_csv(
            path, comment="#", usecols=wanted.__contains__, dtype={"quality": "category"}, nrows=kept.get(os.path.basename(path))
        ).reindex(columns=wanted)
        rows["time_s"] = pandas.to_datetime(rows["time_s"], unit="s")
        if "quality" in wanted:
            qualities.append(rows.pop("quality"))
        for name in rows.columns:  # each column grows in place: a year is in memory once
            before = len(joined[name])
            joined[name].resize(before + len(rows), refcheck=False)
            joined[name][before:] = rows[name]
    if qualities:
        joined["quality"] = pandas.concat(qualities, ignore_index=True).astype("category")
    times = pandas.DatetimeIndex(joined.pop("time_s"), tz="UTC", name="time_utc")
    log = pandas.DataFrame(joined, copy=False).set_axis(times, copy=False)
    unit = {name: next((unit for suffix, unit in UNITS if name.endswith("_" + suffix)), "") for name in log.columns}
    log.attrs = {"units": unit, **segments[0][1]}
    return log
