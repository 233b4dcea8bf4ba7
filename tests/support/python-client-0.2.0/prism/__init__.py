# SPDX-License-Identifier: MIT
"""Asks a running prismd, and follows its rows. The standard library is enough.

    import prism

    gyro = prism.Gyro()                  # the only one that runs; Gyro("gyro1") by name
    print(gyro.bias()["quality"])
    for row in gyro.rows():              # one a second, for ever; over restarts of prismd
        print(row.time_s, row.corrected_mean_deg_per_h, row.quality)

Units stand in the names. None is a quantity that is not known. See prism-protocol(7).
"""

from ._connection import Gone, PrismError, Refused, running_sockets
from .gyro import Gyro
from .rows import Event, LogPage, Sample, Window

__all__ = ["Event", "Gone", "Gyro", "LogPage", "PrismError", "Refused", "Sample", "Window", "running_sockets"]
