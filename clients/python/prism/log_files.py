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
    one column needs 1.3 GB, each further one 0.5 GB. `attrs` has "units", by column, and the metadata of the first segment. Rows
    that a later segment repeats (supersedes) are left out. Raises ValueError.
    """
    import pandas  # only if it is used

    segments = [(path, *read_header(path)) for path in sorted(glob.glob(os.path.join(glob.escape(folder), "*.csv")))]
    axes = sorted({metadata.get("axis", "-") for _, metadata, _ in segments})
    if axis is None and len(axes) != 1:
        raise ValueError(f"{folder}: found the axes {', '.join(axes) or 'of no log'}, expected one: read_log(folder, axis=…)")
    segments = [segment for segment in segments if axis is None or segment[1].get("axis", "-") == axis]
    if not segments:
        raise ValueError(f"{folder}: found no axis {axis}, expected one of {', '.join(axes)}")
    parts = {}
    for path, metadata, names in segments:
        wanted = [name for name in names if name != "time_utc" and (columns is None or name in columns or name == "time_s")]
        types = {name: "category" if name == "quality" else "float64" for name in wanted}
        part = parts[os.path.basename(path)] = pandas.read_csv(path, comment="#", usecols=wanted, dtype=types)
        part.index = pandas.to_datetime(part.pop("time_s"), unit="s", utc=True).rename("time_utc")
        if "supersedes" in metadata:
            name, _, first = metadata["supersedes"].partition(" from row ")
            if name in parts:
                parts[name] = parts[name].iloc[: int(first) - 1]
    log = pandas.concat(parts.values())
    if "quality" in log:
        log["quality"] = log["quality"].astype("category")
    unit = {name: next((unit for suffix, unit in UNITS if name.endswith("_" + suffix)), "") for name in log.columns}
    log.attrs = {"units": unit, **segments[0][1]}
    return log
