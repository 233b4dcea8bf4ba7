#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Plain tables of random forms, some damaged, through every command of prismcal that reads tables: each sees the values that were
written, to the last digit, or refuses the table with the same line. tests/unit/prismcal/plain_table_test.cpp reads thousands
of them with the reader alone. usage: PRISM_BIN=build/unity tests/files/dialects.py [TABLES [SEED]]"""
import json
import math
import os
import random
import sys
import tempfile

import run

NAMES = {"time": "t_s", "rate": "rate_deg_per_h", "temperature": "T_degC", "other": "flow"}
HOLES = ["", "NaN", "nan"]
MODEL = ["--no-earth-rate", "--inputs", "T", "--method", "ls", "--window", "1", "--end-mean", "1", "--force", "--quiet"]


def rows_of(pick, holes):
    """60 rows of text: time, rate, temperature, and a column that no command uses. A hole is None."""
    places = pick.randint(4, 9)
    rows = []
    for i in range(60):
        row = [f"{0.5 * (i + 1):.1f}", f"{8.4 + 0.1 * math.sin(i / 9) + pick.gauss(0, 0.05):.{places}f}",
               f"{20 + i / 32 + pick.gauss(0, 0.01):.5f}", f"{pick.uniform(-9, 9):.3f}"]
        # no hole in the first row, which the detection of the columns' kinds needs
        rows.append([None if c > 0 and i > 3 and holes and pick.random() < 0.05 else cell for c, cell in enumerate(row)])
    return rows


def written(rows, pick):
    """The bytes of a table of a random form, and its description."""
    separator = pick.choice([",", ";", "\t"])
    comma, end = separator != "," and pick.random() < 0.5, pick.choice(["\n", "\r\n"])
    quotes, comment = pick.random() < 0.3, pick.random() < 0.3
    encoding = pick.choice(["utf-8", "utf-8-sig", "latin-1"])
    order = pick.sample(range(4), 4)

    def line(cells):
        cells = [cells[c] for c in order]
        return separator.join(f'"{cell}"' if quotes else cell for cell in cells) + end

    def cell(text):
        text = pick.choice(HOLES) if text is None else text
        return text.replace(".", ",") if comma else text

    text = f"# chamber 1, 20 °C{end}" if comment else ""
    text += line(list(NAMES.values())) + "".join(line([cell(text) for text in row]) for row in rows)
    about = f"separator {separator!r}, decimal comma {comma}, ends {end!r}, quotes {quotes}, {encoding}, comment {comment}"
    return text, encoding, '"' + separator + '"' if quotes else separator, about


def damaged(text, cell_end, pick):
    """The text with a fault in one row that no reader may pass over, and the end of the line that refuses it. `cell_end`: between two cells."""
    end = "\r\n" if "\r\n" in text else "\n"
    lines = text.split(end)
    at = pick.randrange(len(lines) - 40, len(lines) - 5)
    cells, quote = lines[at].split(cell_end), '"' if '"' in cell_end else ""
    lines[at], found = pick.choice([(lines[at] + cell_end.strip('"') + quote + "0" + quote, "found 5 fields, expected 4"),
                                    (cell_end.join(cells[:-1]) + quote, "found 3 fields, expected 4"),
                                    (lines[at][:3] + "\0" + lines[at][3:], "found a NUL byte, expected text")])
    return end.join(lines), f"{at + 1}: {found}"


def commands(path, folder):
    case = {"file": path, "columns": NAMES, "options": []}
    mapping = [word for entry in ("rate=rate_deg_per_h", "temperature=T_degC", "time=t_s") for word in ("--map", entry)]
    return {**run.commands(case, folder), "train": ["train", path, *mapping, *MODEL, "--out", os.path.join(folder, "trained.json")],
            "inspect": ["inspect", path, "--json"]}


def result(name, out, folder):
    if name == "train":
        with open(os.path.join(folder, "trained.json"), encoding="utf-8") as file:
            model = json.load(file)
        return [model[key] for key in ("inputs", "sd_deg_per_h", "terms")] + [model["provenance"]["recordings"][0]["fingerprint"]]
    if name == "inspect":
        found = json.loads(out)
        columns = sorted(([c[key] for key in ("header", "unit", "kind", "smallest", "largest", "holes")] for c in found["columns"]))
        return [columns, found["rows"], found["time"]]
    return run.result(name, out, folder)


def results(path, folder):
    """Command: its result, or its line of refusal."""
    found = {}
    for name, arguments in commands(path, folder).items():
        code, out, err = run.run(*arguments)
        if name == "inspect" and code == 1:
            found[name] = json.loads(out)["problem"] if out.startswith("{") else err.strip()
        else:
            found[name] = result(name, out, folder) if code == 0 else err.strip()
    return found


def main():
    tables, seed = int(sys.argv[1]) if len(sys.argv) > 1 else 24, int(sys.argv[2]) if len(sys.argv) > 2 else 1
    pick, faults = random.Random(seed), []
    with tempfile.TemporaryDirectory(prefix="prism-dialects-") as folder:
        path = os.path.join(folder, "table.csv")
        for number in range(tables):
            if number % 8 == 0:  # the truth of eight tables
                rows = rows_of(pick, holes=number % 16 == 0)
                with open(path, "w", encoding="utf-8") as file:
                    file.write(",".join(NAMES.values()) + "\n" + "".join(",".join(cell or "" for cell in row) + "\n" for row in rows))
                run.run("train", path, "--map", "rate=rate_deg_per_h", "--map", "temperature=T_degC", "--map", "time=t_s", *MODEL,
                        "--out", os.path.join(folder, "seconds.json"))
                truth = results(path, folder)
                faults += [f"the plain table: {name}: {found}" for name, found in truth.items() if isinstance(found, str)]
            text, encoding, cell_end, about = written(rows, pick)
            refusal = ""
            if number % 4 == 3:
                text, refusal = damaged(text, cell_end, pick)
            with open(path, "wb") as file:
                file.write(text.encode(encoding))
            for name, found in results(path, folder).items():
                if refusal and not (isinstance(found, str) and found.endswith(refusal)):
                    faults.append(f"table {number}, {about}: {name}: found {str(found)[:300]}, expected the refusal {refusal}")
                if not refusal and found != truth[name]:
                    faults.append(f"table {number}, {about}: {name}: found {str(found)[:300]} instead of {str(truth[name])[:300]}")
    run.finish(f"{tables} tables", faults)


if __name__ == "__main__":
    main()
