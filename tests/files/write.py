#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Writes the small files of tests/files/data and cases.json from one truth: 60 rows, two a second. usage: write.py

A case: "file", the "options" with which each command reads the truth, and for a file that is not a plain table, or that is damaged, "refused"
(the line of each command, without "prismcal: "). Files of the same truth must give each command the same result as data/plain.csv."""
import datetime
import json
import math
import os
import struct

HERE = os.path.dirname(os.path.abspath(__file__))
DATA = os.path.join(HERE, "data")
N = 60
TIME = [0.5 * (i + 1) for i in range(N)]
RATE = [round(8.4 + 0.05 * math.sin(0.7 * i) + 0.01 * ((i * 37) % 11 - 5), 5) for i in range(N)]
TEMP = [round(20 + 0.03125 * i, 5) for i in range(N)]
EPOCH = datetime.datetime(2024, 3, 25, 12, 0, 0)  # day 25: the order of day and month is certain
cases = []
ADVICE = "; prism-import reads tables of other programs"
NO_TIME, NO_UNIT = "expected a time as 2024-03-01 12:00:05.250 or a number" + ADVICE, "without a unit, expected one in its name as [s], or --time-unit"
# Files that prismcal does not read: a part of the refusal.
OTHER = {
    "bar.csv": "FILE:2: found \"0.5|8.35000|20.00000\", expected numbers below the names of line 1" + ADVICE,
    "blanks.txt": "FILE:2: found \"0.5  8.35000  20.00000\", expected numbers" , "blanks-aligned.txt": "expected numbers below the names of line 1" + ADVICE,
    "colon.txt": "expected numbers below the names of line 1" + ADVICE, "quoted-comma.csv": "found \"", "sep-line.csv": "FILE:2: found 3 fields, expected 2 as in the names of line 1" + ADVICE,
    "utf16le.csv": "FILE: is UTF-16 or UTF-32 text" + ADVICE, "utf16be.csv": "FILE: is UTF-16 text" + ADVICE, "utf16-no-bom.csv": "FILE: is UTF-16 text" + ADVICE,
    "utf32.csv": "FILE: is UTF-16 or UTF-32 text" + ADVICE, "cr.csv": "FILE:1: found a line end CR without LF" + ADVICE,
    "comments.csv": "FILE:3: found \"// and this\", expected numbers below the names of line 2" + ADVICE, "numpy.txt": "expected numbers below the names of line 2" + ADVICE,
    "labview.lvm": "FILE: is a LabVIEW measurement file (.lvm)" + ADVICE, "labview-units.lvm": "FILE: is a LabVIEW measurement file (.lvm)" + ADVICE,
    "preamble.csv": "FILE:2: found \"Operator: Mueller\", expected numbers below the names of line 1" + ADVICE,
    "header-newline.csv": "FILE:1: found a quote within a name, or one that does not end" + ADVICE, "no-names.csv": "FILE:1: found \"0.5\", expected a line of names" + ADVICE,
    "header-row.csv": "FILE:2: found \"t_s\", expected numbers below the names of line 1" + ADVICE, "grouped.csv": "column r: found \"8,350,000.0\", expected a number" + ADVICE,
    "terminal-stamps.log": "expected numbers below the names of line 1" + ADVICE, "terminal-title.log": "expected numbers below the names of line 1" + ADVICE,
    "terminal-stamps.csv": "FILE:1: found \"8.35000\", expected a line of names" + ADVICE, "campbell.dat": "FILE:1: found \"1234\", expected a line of names" + ADVICE,
    "origin-comments.txt": ADVICE, "holes.csv": "found \"-\", expected a number" + ADVICE, "holes-excel.csv": "found \"-\", expected a number" + ADVICE}
# Only their time is not plain.
OTHER_TIME = {
    "unix.csv": NO_UNIT, "unix-ms.csv": NO_UNIT, "unix-ns.csv": NO_UNIT, "excel-days.csv": NO_UNIT, "datenum.csv": NO_UNIT, "labview-1904.csv": NO_UNIT, "gps.csv": NO_UNIT,
    "filetime.csv": NO_UNIT, "dotnet-ticks.csv": NO_UNIT, "german-date.csv": NO_TIME, "slash-date.csv": NO_TIME, "month-name.csv": NO_TIME,
    "two-columns.csv": NO_TIME, "us-date.csv": NO_TIME}


def put(name, text, encoding="utf-8"):
    with open(os.path.join(DATA, name), "wb") as file:
        file.write(text if isinstance(text, bytes) else text.encode(encoding))


def num(value, decimal=".", digits=5):
    return f"{value:.{digits}f}".replace(".", decimal)


def table(sep=",", decimal=".", time=None, head=("t_s", "rate_deg_per_h", "T_degC"), end="\n", quote=False, rate=None, temp=None,
          above="", units="", tail=""):
    time = time or [num(t, decimal, 1) for t in TIME]
    rate = rate or [num(r, decimal) for r in RATE]
    temp = temp or [num(t, decimal) for t in TEMP]
    lines = [above] if above else []
    if head:
        lines.append(sep.join(f'"{h}"' if quote else h for h in head))
    if units:
        lines.append(units)
    for cells in zip(time, rate, temp):
        lines.append(sep.join(f'"{c}"' if quote or (sep == decimal and decimal in c) else c for c in cells) + tail)
    return end.join(line.replace("\n", end) for line in lines) + end


def same(name, text, encoding="utf-8", columns=("t_s", "rate_deg_per_h", "T_degC"), options=(), date=False, time=None):
    put(name, text, encoding)
    t, r, temperature = columns
    cases.append({"file": name, "columns": {"time": time or t, "rate": r, "temperature": temperature}, "options": list(options), "date": date})
    if name in OTHER or name in OTHER_TIME:
        cases[-1]["refused"] = OTHER.get(name) or OTHER_TIME[name]
    if name in OTHER_TIME:
        cases[-1]["inspect"] = 1


def refused(name, text, line, encoding="utf-8", columns=("t_s", "rate_deg_per_h", "T_degC"), options=(), inspect=None):
    put(name, text, encoding)
    case = {"file": name, "refused": line, "columns": dict(zip(("time", "rate", "temperature"), columns)), "options": list(options)}
    if inspect is not None:
        case["inspect"] = inspect
    cases.append(case)


def stamps(form):
    return [form(EPOCH + datetime.timedelta(seconds=t)) for t in TIME]


def iso(d, sep="T", decimal=".", zone=""):
    return d.strftime(f"%Y-%m-%d{sep}%H:%M:%S") + f"{decimal}{d.microsecond // 1000:03d}{zone}"


def day_first(d, decimal=",", sep="."):
    return d.strftime(f"%d{sep}%m{sep}%Y %H:%M:%S") + f"{decimal}{d.microsecond // 1000:03d}"


def main():
    os.makedirs(DATA, exist_ok=True)
    # Separators and decimal signs.
    same("plain.csv", table())
    same("semicolon.csv", table(";"))
    same("semicolon-comma.csv", table(";", ","))
    same("tab.txt", table("\t"))
    same("tab-comma.txt", table("\t", ","))
    same("bar.csv", table("|"))
    same("blanks.txt", table("  "))
    same("blanks-aligned.txt", "".join("   ".join(f"{c:>12}" for c in row) + "\n" for row in
         [("t_s", "rate_deg_per_h", "T_degC")] + [(num(t, digits=1), num(r), num(c)) for t, r, c in zip(TIME, RATE, TEMP)]))
    same("quoted-comma.csv", table(",", ","))
    same("all-quoted.csv", table(quote=True))
    same("sep-line.csv", "sep=;\n" + table(";", ","))
    same("trailing.csv", table(";", head=("t_s", "rate_deg_per_h", "T_degC", ""), tail=";"))
    same("colon.txt", table(":"))
    # Encodings and line ends.
    same("bom.csv", "\ufeff" + table())
    same("utf16le.csv", "\ufeff" + table(), "utf-16-le")
    same("utf16be.csv", "\ufeff" + table(), "utf-16-be")
    same("utf16-no-bom.csv", table(";"), "utf-16-le")
    german = ("Zeit [s]", "Drehrate [°/h]", "Temperatur (°C)")
    same("utf32.csv", "\ufeff" + table(), "utf-32-le")
    same("latin1.csv", table(";", ",", head=german), "latin-1", german)
    same("german-utf8.csv", table(";", ",", head=german), "utf-8", german)
    same("greek.csv", table(head=("Χρόνος [s]", "ταχύτητα [deg/h]", "T [degC]")), "iso-8859-7",
         ("1", "2", "3"))
    same("crlf.csv", table(end="\r\n"))
    same("cr.csv", table(end="\r"))
    same("blank-lines.csv", table().replace("\n", "\n\n"))
    same("empty-rows.csv", table(";") + ";;\n;;\n")
    # Above the data.
    same("comments.csv", "# made by hand\n% another\n// and this\n" + table() + "# the end\n")
    same("numpy.txt", "# " + table(" "))
    same("units-row.csv", table(head=("t", "rate", "T"), units="s,deg/h,degC"), columns=("t", "rate", "T"))
    same("units-brackets.csv", table(";", ",", head=("t", "rate", "T"), units="[s];[°/h];[°C]"), columns=("t", "rate", "T"))
    same("labview.lvm", "LabVIEW Measurement\t\nWriter_Version\t2\nSeparator\tTab\nDecimal_Separator\t,\nDate\t2024/03/25\n"
         "Time\t12:00:00,5\n***End_of_Header***\t\n\t\nChannels\t2\t\t\nSamples\t60\t60\t\nX_Dimension\tTime\tTime\t\n"
         "X0\t0,0E+0\t0,0E+0\t\nDelta_X\t0,5\t0,5\t\n***End_of_Header***\t\t\t\n"
         + table("\t", ",", head=("X_Value", "rate", "T", "Comment")), columns=("X_Value", "rate", "T"), time="X_Value:s")
    same("labview-units.lvm", "LabVIEW Measurement\t\nSeparator\tTab\nDecimal_Separator\t.\n***End_of_Header***\t\n\t\nChannels\t2\t\t\n"
         "Y_Unit_Label\tdeg/s\tK\t\nDelta_X\t0.5\t0.5\t\n***End_of_Header***\t\t\t\n"
         + table("\t", rate=[f"{r / 3600:.17g}" for r in RATE], temp=[num(t + 273.15) for t in TEMP], head=("X_Value", "gyro", "chamber", "Comment")),
         columns=("X_Value", "gyro", "chamber"), time="X_Value:s", options=["--nearly"])
    same("preamble.csv", "Station 4\nOperator: Mueller\nStarted at 12:00\n\n" + table(";"))
    same("matlab-writetable.csv", table(head=("Time", "rate_x", "Temp")), columns=("Time", "rate_x", "Temp"), time="Time:s", options=["--time-unit", "s"])
    same("header-newline.csv", table(head=("t_s", '"rate\n[deg/h]"', "T_degC")), columns=("1", "2", "3"))
    same("no-names.csv", table(head=None), columns=("1", "2", "3"), time="1:s")
    same("header-row.csv", "some;words;here\n" + table(";"))
    # Numbers.
    same("exponents.csv", table(rate=[f"{r:.5e}".replace("e", "E") for r in RATE]))
    same("plus.csv", table(rate=["+" + num(r) for r in RATE]))
    same("grouped.csv", table(";", rate=[f"{r / 1e-6:,.1f}" for r in RATE], head=("t_s", "r", "T_degC")),
         columns=("t_s", "r", "T_degC"), options=["--scaled"])
    # Units.
    same("deg-per-s.csv", table(rate=[f"{r / 3600:.17g}" for r in RATE], head=("t_s", "gyro_x (deg/s)", "T_degC")),
         columns=("t_s", "gyro_x (deg/s)", "T_degC"), options=["--nearly"])
    same("rad-per-s.csv", table(rate=[f"{math.radians(r) / 3600:.17g}" for r in RATE], head=("t_s", "gyro_x (rad/s)", "T_degC")),
         columns=("t_s", "gyro_x (rad/s)", "T_degC"), options=["--nearly"])
    same("kelvin.csv", table(temp=[num(t + 273.15) for t in TEMP], head=("t_s", "rate [deg/h]", "T [K]")),
         columns=("t_s", "rate [deg/h]", "T [K]"), options=["--nearly"])
    same("fahrenheit.csv", table(temp=[f"{t * 1.8 + 32:.17g}" for t in TEMP], head=("t_s", "rate [deg/h]", "T (°F)")),
         columns=("t_s", "rate [deg/h]", "T (°F)"), options=["--nearly"])
    # Times.
    for unit, factor in (("ms", 1e3), ("us", 1e6), ("ns", 1e9)):
        same(f"time-{unit}.csv", table(time=[f"{t * factor:.0f}" for t in TIME], head=(f"t_{unit}", "rate_deg_per_h", "T_degC")),
             columns=(f"t_{unit}", "rate_deg_per_h", "T_degC"))
    same("time-bracket-us.csv", table(time=[f"{t * 1e6:.0f}" for t in TIME], head=("Zeit [µs]", "rate_deg_per_h", "T_degC")),
         columns=("Zeit [µs]", "rate_deg_per_h", "T_degC"))
    named = ("time", "rate_deg_per_h", "T_degC")
    same("time-ns-stated.csv", table(time=[f"{t * 1e9:.0f}" for t in TIME], head=named), columns=named, options=["--time-unit", "ns"])
    unix = int(EPOCH.replace(tzinfo=datetime.timezone.utc).timestamp())
    same("unix.csv", table(time=[f"{unix + t:.1f}" for t in TIME], head=named), columns=named, date=True)
    same("unix-ms.csv", table(time=[f"{(unix + t) * 1000:.0f}" for t in TIME], head=named), columns=named, date=True)
    same("unix-ns.csv", table(time=[str(unix * 10**9 + int(t * 10) * 10**8) for t in TIME], head=named), columns=named, date=True)
    same("iso-t.csv", table(time=stamps(iso), head=named), columns=named, date=True)
    same("iso-blank.csv", table(time=stamps(lambda d: iso(d, " ")), head=named), columns=named, date=True)
    same("iso-zone.csv", table(time=stamps(lambda d: iso(d + datetime.timedelta(hours=2), zone="+02:00")), head=named), columns=named, date=True)
    same("iso-z.csv", table(time=stamps(lambda d: iso(d, zone="Z")), head=named), columns=named, date=True)
    same("german-date.csv", table(";", ",", time=stamps(day_first), head=("Datum", "rate_deg_per_h", "T_degC")),
         columns=("Datum", "rate_deg_per_h", "T_degC"), date=True)
    same("slash-date.csv", table(time=stamps(lambda d: d.strftime("%m/%d/%Y %I:%M:%S") + f".{d.microsecond // 1000:03d} " + d.strftime("%p")),
                                 head=named), columns=named, date=True)
    same("month-name.csv", table(time=stamps(lambda d: d.strftime("%d-%b-%Y %H:%M:%S") + f".{d.microsecond // 1000:03d}"), head=named),
         columns=named, date=True)
    same("two-columns.csv", table(";", time=stamps(lambda d: d.strftime("%Y-%m-%d;%H:%M:%S") + f".{d.microsecond // 1000:03d}"),
                                  head=("date;time", "rate_deg_per_h", "T_degC")), columns=("date", "rate_deg_per_h", "T_degC"), date=True)
    # A terminal program's stamps; before, they were text.
    stamped = stamps(lambda d: f"[{iso(d, ' ')}]")
    same("terminal-stamps.log", table(" ", time=stamped, head=()), columns=("1", "3", "4"), date=True)
    # A title with as many words as a row has cells, two of them a time: it was a row, and all columns were text.
    same("terminal-title.log", table(" ", time=stamped, head=(), above="=~=~= log 2024.03.25 12:00:00"), columns=("1", "3", "4"), date=True)
    same("terminal-stamps.csv", table(",", time=stamped, head=()), columns=("1", "2", "3"), date=True)
    same("us-date.csv", table(time=stamps(lambda d: d.strftime("%m/%d/%Y %H:%M:%S") + f".{d.microsecond // 1000:03d}"), head=named),
         columns=named, date=True)
    same("excel-days.csv", table(time=[f"{45376 + (43200 + t) / 86400:.10f}" for t in TIME], head=named), columns=named, date=True, options=["--nearly"])
    same("datenum.csv", table(time=[f"{739336 + (43200 + t) / 86400:.10f}" for t in TIME], head=named), columns=named, date=True, options=["--nearly"])
    same("labview-1904.csv", table(time=[f"{unix + t + 2082844800:.1f}" for t in TIME], head=named), columns=named, date=True)
    gps = unix - 315964800
    same("gps.csv", table(time=[f"{gps // 604800},{gps % 604800 + t:.1f}" for t in TIME], head=("gps_week,tow_s", "rate_deg_per_h", "T_degC")),
         columns=("gps_week", "rate_deg_per_h", "T_degC"), date=True)
    for name, factor in (("time_min", 60), ("time_h", 3600), ("Time [days]", 86400)):
        same(f"time-{factor}-s.csv", table(time=[f"{t / factor:.13f}" for t in TIME], head=(name, "rate_deg_per_h", "T_degC")),
             columns=(name, "rate_deg_per_h", "T_degC"), options=["--nearly"])
    for name, epoch_s in (("filetime.csv", 11644473600), ("dotnet-ticks.csv", 62135596800)):
        same(name, table(time=[str((unix + epoch_s) * 10**7 + int(t * 10) * 10**6) for t in TIME], head=named), columns=named, date=True)
    # Other programs' lines above the data, and columns next to it.
    same("campbell.dat", '"TOA5","CR1000","CR1000","1234","CR1000.Std.05"\n"TIMESTAMP","rate","T"\n"TS","deg/h","Deg C"\n"","Avg","Smp"\n'
         + table(time=stamps(lambda d: f'"{d:%Y-%m-%d %H:%M:%S}.{d.microsecond // 100000}"'), head=()), columns=("TIMESTAMP", "rate", "T"), date=True)
    same("origin-comments.txt", "t\trate\tT\ns\tdeg/h\t°C\n\tfirst run\tchamber\n" + table("\t", head=()), columns=("t", "rate", "T"))
    same("checksum-column.csv", "t_s,rate_deg_per_h,T_degC,check\n" + "".join(
        f"{line},{37 * i % 256:02X}\n" for i, line in enumerate(table(head=()).splitlines())))
    same("torn.csv", table()[:-1] + "\n30.5,8.4", columns=("t_s", "rate_deg_per_h", "T_degC"))
    same("extra-columns.csv", "".join(line + (",note" if i == 0 else ",ok") + "\n" for i, line in enumerate(table().splitlines())))
    holes = [("", "NaN", "N/A", "-", "#NUM!", "inf")[i % 6] if i % 10 == 3 else num(r) for i, r in enumerate(RATE)]
    same("holes.csv", table(rate=holes), options=["--holes"])
    same("missing.csv", table(rate=[("", "NaN")[i % 2] if i % 10 == 3 else r for i, r in enumerate(holes)]), options=["--holes"])
    same("holes-excel.csv", table(";", ",", rate=[h.replace(".", ",") if h not in ("N/A",) else "#N/A" for h in holes]), options=["--holes"])

    # Refusals: the line names the finding and the option that decides.
    lines = table().splitlines()
    f = "FILE"
    refused("short-row.csv", "\n".join(lines[:20] + ["9.9,8.4"] + lines[20:]) + "\n", f"{f}:21: found 2 fields, expected 3")
    refused("long-row.csv", "\n".join(lines[:20] + ["9.9,8.4,20,1"] + lines[20:]) + "\n", f"{f}:21: found 4 fields, expected 3")
    refused("text-cell.csv", "\n".join(lines[:20] + ["10.0,warm,20"] + lines[21:]) + "\n", f'{f}:21: column rate_deg_per_h: found "warm", expected a number')
    refused("bad-first-row.csv", "\n".join([lines[0], "0.5,warm,20"] + lines[2:]) + "\n", f'{f}:2: column rate_deg_per_h: found "warm", expected a number')
    refused("thousands-or-decimals.csv", table(";", ",", time=[str(i) for i in range(N)], rate=[num(r, ",", 3) for r in RATE],
            temp=[num(t, ",", 3) for t in TEMP]), "two readings are possible")
    refused("one-column.csv", "".join(f"{num(r, ',', 2)}\n" for r in RATE), f'{f}:1: found "8", expected a line of names', columns=("1", "1", "1"))
    refused("either-date.csv", table(time=[f"03/04/2024 12:00:{t:04.1f}" for t in TIME], head=named), NO_TIME, columns=named, inspect=1)
    newyear = [f"{1 + (i > 30):02}/01/2024 {(11 + i // 30 * 12) % 24:02}:{i % 30:02}:00" for i in range(N)]
    refused("either-date-later.csv", table(time=newyear, head=named), NO_TIME, columns=named, inspect=1)
    refused("time-unknown-unit.csv", table(time=[f"{t * 1e9:.0f}" for t in TIME], head=named), NO_UNIT, columns=named, inspect=1)
    refused("time-minutes.csv", table(time=[f"00:{int(t):02d}" for t in TIME], head=named),
            NO_TIME, columns=named, inspect=1)
    refused("time-digits.csv", table(time=[f"{120030 + i + (40 if i > 29 else 0)}" for i in range(N)], head=named),
            NO_UNIT, columns=named, inspect=1)
    kiloseconds = ("Time (ks)", "rate_deg_per_h", "T_degC")
    refused("time-kiloseconds.csv", table(time=[f"{t / 1000:.4f}" for t in TIME], head=kiloseconds),
            NO_UNIT, columns=kiloseconds, inspect=1)
    refused("time-day-fraction.csv", table(time=[f"{0.5 + t / 86400:.12f}" for t in TIME], head=named),
            NO_UNIT, columns=named, inspect=1)
    refused("units-differ.csv", table(head=("t_s", "rate [deg/h]", "T_degC"), units="s,deg/s,degC"),
            f"{f}:1: column rate [deg/h]: found the unit deg/s in line 2, expected deg/h as in its name", columns=("t_s", "rate [deg/h]", "T_degC"))
    refused("grouped-integers.csv", table(";", rate=[f"{700 + 8 * i:,}".replace(",", ".") for i in range(N)]),
            'column rate_deg_per_h: two readings are possible: "1.004" is 1.004 or, with grouped digits, 1004')
    refused("two-names.csv", table(head=("t_s", "rate_deg_per_h", "t_s")), f'{f}:1: found column "t_s" twice')
    refused("nul.csv", table().replace("8.4", "8\0.4", 1).encode(), "found a NUL byte, expected text")
    refused("names-only.csv", lines[0] + "\n", f"{f}: found no row of numbers below a line of names")
    refused("empty.csv", "", f"{f}: found no row of numbers: the file is empty")
    refused("narrow-names.csv", table(head=("t_s", "rate_deg_per_h")), f"{f}:2: found 3 fields, expected 2 as in the names of line 1")
    refused("open-quote.csv", table().replace("8.3", '"8.3', 1), "quote")
    refused("backward.csv", "\n".join(lines[:20] + ["1.0,8.4,20"] + lines[21:]) + "\n", "expected increasing times", inspect=0)
    refused("excel.xlsx", b"PK\x03\x04" + bytes(60), f"{f}: is an Excel or other ZIP file (.xlsx)" + ADVICE)
    refused("old.xls", b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1" + bytes(60), "is an old Excel file (.xls)")
    refused("labview.tdms", b"TDSm" + bytes(60), "is a TDMS file of LabVIEW")
    refused("px4.ulg", b"ULog\x01\x12\x35\x01" + bytes(60), "is a ULog of PX4" + ADVICE)
    refused("ros.bag", b"#ROSBAG V2.0\n" + bytes(60), "is a bag of ROS")
    refused("ros2.mcap", b"\x89MCAP0\r\n" + bytes(60), "is an MCAP file")
    refused("packed.csv.gz", b"\x1f\x8b\x08\x00" + bytes(60), "is compressed by gzip")
    with open(os.path.join(HERE, "cases.json"), "w") as file:
        json.dump(cases, file, indent=1, ensure_ascii=False)
        file.write("\n")
    print(f"{len(cases)} cases")


if __name__ == "__main__":
    main()
