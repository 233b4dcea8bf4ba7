# SPDX-License-Identifier: MIT
"""Client of prismd: requests its state and follows its rows. Needs only the standard library, numpy for Model, and pandas for read_log.

    import prism

    gyro = prism.Gyro()                  # the only running one; Gyro("gyro1") by name
    print(gyro.bias()["quality"])
    for row in gyro.rows():              # one per second, without end; also after restarts of prismd
        print(row.time_s, row.corrected_mean_deg_per_h, row.quality)

Names end with their unit. None is an unknown quantity. See prism-protocol(7).
"""

from ._connection import Gone, PrismError, Refused, running_sockets
from .gyro import Gyro
from .log_files import read_log
from .rows import Event, LogPage, Sample, Window


def __getattr__(name):
    if name != "Model":
        raise AttributeError(name)
    from .model import Model  # numpy only if it is used

    return Model


__all__ = ["Event", "Gone", "Gyro", "LogPage", "Model", "PrismError", "Refused", "Sample", "Window", "read_log", "running_sockets"]
