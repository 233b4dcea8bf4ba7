# SPDX-License-Identifier: MIT
# Prints every row of the logs in the given directories as "log segment row time rate temperature quality", sorted by log, segment and
# row. Reads only the files.
import glob
import re
import sys

lines = []
for folder in sys.argv[1:]:
    for path in sorted(glob.glob(folder + "/*.csv")):
        text = open(path).read()
        log, number = re.search("^# log: ([0-9a-f]+) segment ([0-9]+) ", text, re.M).groups()
        whole = text[: text.rfind("\n") + 1].splitlines()
        columns, row = None, 0
        for line in whole:
            if line.startswith("#"):
                continue
            if columns is None:
                columns = line.split(",")
                continue
            row += 1
            fields = dict(zip(columns, line.split(",")))
            lines.append((log, int(number), row, fields["time_s"], fields["rate_deg_per_h"], fields["temperature_degc"], fields["quality"]))
for line in sorted(lines):
    print(*line)
