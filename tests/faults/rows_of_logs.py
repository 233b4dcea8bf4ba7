# SPDX-License-Identifier: MIT
# Prints every row of the logs in the given directories as "log segment row time rate temperature quality", sorted by log, segment and
# row. Reads only the files.
import glob
import json
import os
import sys

lines = []
for folder in sys.argv[1:]:
    (index,) = glob.glob(folder + "/*.csv.index")
    entries = [json.loads(line) for line in open(index)]
    log = entries[0]["id"]
    for number, name in ((entry["made"], entry["file"]) for entry in entries if "made" in entry):
        if not os.path.exists(os.path.join(folder, name)):
            sys.exit(f"{name} is in the index but does not exist")
        text = open(os.path.join(folder, name)).read()
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
            lines.append((log, number, row, fields["time_s"], fields["rate_deg_per_h"], fields["temperature_degc"], fields["quality"]))
for line in sorted(lines):
    print(*line)
