#!/usr/bin/python3
# SPDX-License-Identifier: MIT
"""prism-import: a table of another program (CSV of any kind, Excel, MATLAB) to a plain table for prismcal; hex text to bytes.
From the end of this file upward: convert() reads a Table of text; the forms of a column's cells ("8,41" has the form "9,99") decide how
they are read. Numbers stay text: only signs, points and commas change. If two readings are possible, an option decides."""
import argparse, array, collections, contextlib, csv, datetime, functools, itertools, math, os, pathlib, re, resource, signal, sys, warnings, zipfile, zlib
from decimal import Decimal

SAMPLE_ROWS, NS, QUOTE = 1000, 1_000_000_000, chr(34)


class Refused(Exception):
    """The file is not converted: "place: finding, expectation, advice"."""


def check(is_good, refusal):
    if not is_good:
        raise Refused(refusal)


HOLES = set("nan -nan +nan nan(ind) -nan(ind) na n/a #n/a - -- null none nil ? inf +inf -inf infinity -infinity #num! #value! "
            "#div/0! #wert! #ref! 0.#qnan -0.#ind 0.#inf -0.#inf".split()) | {""}
GROUPS = "'\u2019 \u00a0\u202f"  # between groups of three digits, besides a point or comma
NUMBERS = {sign: re.compile(rf"[+-]?(?:(?:[09]9*{mark}?9*|{mark}9+)(?:[eE][+-]?[09]9?9?)?|9{{1,3}}(?P<g>[{other}{GROUPS}])999(?:(?P=g)999)*(?:{mark}9*)?)")
           for sign, mark, other in ((".", r"\.", ","), (",", ",", r"\."))}
EITHER = re.compile(r"[+-]?9{1,3}[.,]999")  # 1.234 and 1,234: decimals, or 1234 with grouped digits; but 0,500 has no groups


def form_of(cell):
    """The cell with 9 for each digit but a leading zero."""
    return re.sub(rf"(?<=[0-9.,{GROUPS}])[0-9]|[1-9]", "9", cell)


@functools.lru_cache(maxsize=1 << 16)
def decimal_signs(form):
    """The decimal signs with which a form is a number: ".", ",", both or none."""
    return "".join(sign for sign in ".," if len(form) < 64 and NUMBERS[sign].fullmatch(form))


def plain_number(cell, sign):
    """The number with a decimal point, without groups and plus."""
    cell = re.sub(f"[{GROUPS}{'.' if sign == ',' else ','}]", "", cell.lstrip("+")).replace(sign, ".")
    return re.sub(r"\.(?![0-9])", "", re.sub(r"(?<![0-9])\.", "0.", cell))


def pieces_of(items):
    """Lists of 4096 items."""
    items = iter(items)
    while piece := [*itertools.islice(items, 4096)]:
        yield piece


class Cells:
    """The texts of a column, joined in pieces: in little more memory than in the file. No text has a line end."""

    def __init__(self, cells=()):
        self.pieces = ["\n".join(piece) for piece in pieces_of(cells)]

    def __len__(self):
        return sum(piece.count("\n") + 1 for piece in self.pieces)

    def __iter__(self):
        return (cell for piece in self.pieces for cell in piece.split("\n"))

    def __getitem__(self, row):
        return next(itertools.islice(self, row, None))


class Column:
    """Cells without blanks around them or behind a sign. forms: {form: row of its first cell}; evidence: {sign: row} of numbers with one
    decimal sign only; fraction: its digits if it may be the ms or us of the times before it."""

    def __init__(self, number, name, unit):
        name = " ".join(re.sub(r"[\x00-\x1f\x7f-\x9f]", " ", name).split())
        own = split_unit(name)[1]
        check(not unit or own in ("", unit), f"column {name}: found the unit {unit} in the row of units, expected {own} as in its name")
        self.title = f"{name} [{unit}]" if unit and name and not own else name or f"column {number}"
        self.number, self.sign, (self.bare, self.unit) = number, ".", split_unit(self.title)
        self.cells, self.forms = Cells(), {}

    def extend(self, cells):
        cells = [re.sub(r"^([+-]) +(?=[0-9])", r"\1", " ".join(cell.split("\n")).strip().replace("\u2212", "-")) for cell in cells]
        for row, cell in enumerate(cells, len(self.cells)) if len(self.forms) < 10000 else ():  # more are texts
            self.forms.setdefault(form_of(cell), row)
        self.cells.pieces.append("\n".join(cells))

    def judge(self):
        """After the last cell."""
        signs = {form: decimal_signs(form) for form in self.forms}
        self.is_number = any(signs.values())
        self.evidence = {signs[form]: row for form, row in reversed(self.forms.items()) if len(signs[form]) == 1}
        self.fraction = {"ms": 3, "msec": 3, "us": 6}.get(self.bare.lower(), 3 if set(self.forms) <= {"999", "099"} else 0)

    def choose_sign(self, stated, of_all, lines):
        """Sets the decimal sign. `of_all`: the signs for which any column has evidence."""
        self.sign = stated or next(iter(self.evidence), ".")
        places = " and ".join(f"\"{self.cells[row]}\" in line {lines[row]}" for row in self.evidence.values())
        check(stated or len(self.evidence) < 2, f"column {self.title}: found {places}, expected one decimal sign; --decimal . or --decimal ,")
        for row in [] if stated or self.evidence else sorted(row for form, row in self.forms.items() if EITHER.fullmatch(form))[:1]:
            cell, whole = self.cells[row], [len(form.lstrip("+-")) for form in self.forms if form.lstrip("+-").isdigit()]
            self.sign, other = (",", ".") if "," in cell else (".", ",")
            if of_all != {self.sign} or whole and max(whole) < 4:
                both = " or ".join(f"{plain_number(cell, sign)} (--decimal \"{self.title}:{sign}\")" for sign in (self.sign, other))
                raise Refused(f"line {lines[row]}: column {self.title}: two readings are possible: \"{cell}\" is {both}")

    def plain(self, lines=()):
        """The Cells in plain form, "" if missing. With `lines`, refuses a cell that is neither a number nor missing."""
        numbers = {form for form in self.forms if self.sign in decimal_signs(form)}
        for row in sorted(row for form, row in self.forms.items() if form not in numbers and form.lower() not in HOLES) if lines else ():
            raise Refused(f"line {lines[row]}: column {self.title}: found \"{self.cells[row][:40]}\", expected a number with the decimal sign "
                          f"\"{self.sign}\"; --missing TEXT or --lenient counts such cells as missing, --columns leaves the column out")
        return Cells(plain_number(cell, self.sign) if form_of(cell) in numbers else "" for cell in self.cells)


class Table:
    """Columns of rows (line, cells); `lines`: the line of the file of each row; `signs`: the decimal sign of this kind of file; `notes`: for the user."""

    def __init__(self, text, names, units, rows, signs, notes):
        self.text, self.lines, self.signs, self.notes = text, array.array("q"), signs, notes
        self.columns = [Column(*column) for column in zip(itertools.count(1), names, units or itertools.repeat(""))]
        self.names = ", ".join(f"{column.number} {column.title}" for column in self.columns[:30])
        for piece in pieces_of(rows):
            self.lines.extend(line for line, _ in piece)
            for column, cells in zip(self.columns, zip(*(cells for _, cells in piece))):
                column.extend(cells)
        for column in self.columns:
            column.judge()

    def locate(self, text):
        """The column with this name (with its unit or without) or number, or None."""
        for names in zip(*((column.title, column.bare, str(column.number)) for column in self.columns)):
            check(names.count(text) < 2, f"found column \"{text}\" twice, expected one; give its number, one of {self.names}")
            if text in names:
                return self.columns[names.index(text)]


UNITS = set("deg/h °/h deg/hr °/hr deg/s °/s dps rad/s arcsec/s degc deg_c °c ℃ ﾟc c k kelvin degf °f f v volt volts mv deg rad a ma pa "
            "hpa bar g m m/s² m/s^2 hz ° %".split()) | {"deg c", "° c", "rad / s"}
NO_UNITS = re.compile(r"ts|rn|no\.|-|1|time|unit|ao?\d{3,}")  # in rows of units, too
SECONDS = {"s": "1", "ms": "1e-3", "us": "1e-6", "ns": "1e-9", "min": "60", "h": "3600", "d": "86400"}
TIME_UNITS = {word: words.split()[0] for words in (
    "s sec secs second seconds sekunden", "ms msec millisecond milliseconds", "us usec µs μs microseconds", "ns nsec nanoseconds",
    "min mins minute minutes minuten", "h hr hrs hour hours std stunden", "d day days tage") for word in words.split()}
TIME_NAME = re.compile(r"(?i)time|zeit|datum|\bdate|stamp|uhr|时间|時間|日付|日時|время|fecha|hora\b|^(?-i:t)$|^x_value$")


def split_unit(name):
    """(name, unit) of "Rate [deg/h]" and "Rate, deg/h"; the unit may be ""."""
    found = re.fullmatch(r"(.*\S)\s*[\[(<（]([^\[\]()<>（）]+)[\])>）]", name) or re.fullmatch(r"(.*\S)\s*(?:,|/| in)\s+(\S+)", name)
    return found.groups() if found else (name, "")


def time_unit(column):
    """The unit of time in a column's name or row of units, as "t_ms", "Time [s]" or "Hours"; "?" if it is unknown; "" without one."""
    name = column.title.lower()
    if column.unit:
        return TIME_UNITS.get(column.unit.lower().strip("[]() "), "?" if TIME_NAME.search(column.bare) else "")
    ending = re.search(r"(?<!deg)(?<!rad)(?<!per)_(ns|us|ms|s|sec|min|h|d)$", name)
    if ending and (ending[1] not in ("min", "h", "d") or TIME_NAME.search(name) or re.match("t_|elapsed", name)):
        return TIME_UNITS[ending[1]]
    return "s" if name == "x_value" else TIME_UNITS.get(name, "") if len(name) > 1 else ""  # X_Value: LabVIEW


CLOCK = (r"(?P<H>[0-9]{1,4}):(?P<M>[0-5][0-9])(?::(?P<S>[0-5][0-9])(?:[.,](?P<f>[0-9]{1,9})[0-9]*|:(?P<ms>[0-9]{3}))?)?"
         r"(?:\s*(?P<half>[AaPp])\.?[Mm]\.?)?(?:\s*(?P<zone>Z|UTC|GMT|[+-][0-9]{2}:?[0-9]{2}))?")
YEAR, SHORT, MONTH, DAY, NAME = "(?P<y>[0-9]{4})", "(?P<y>[0-9]{2})", "(?P<m>[0-9]{1,2})", "(?P<d>[0-9]{1,2})", r"(?P<m>[^\W\d_]{3,9})"
DATES = [("ymd", rf"{YEAR}([-/.]){MONTH}\2{DAY}"), ("ymd", r"(?P<y>[0-9]{4})(?P<m>[0-9]{2})(?P<d>[0-9]{2})(?=[T ])"),
         ("dmy", rf"{DAY}([-/. ]){MONTH}\2{YEAR}"), ("mdy", rf"{MONTH}([-/ ]){DAY}\2{YEAR}"),
         ("dmy", rf"{DAY}([-/.]){MONTH}\2{SHORT}"), ("mdy", rf"{MONTH}([-/]){DAY}\2{SHORT}"), ("ymd", rf"{SHORT}([-/.]){MONTH}\2{DAY}"),
         ("dmy", rf"{DAY}([-/. ]|\. ){NAME}\.?\2(?P<y>[0-9]{{4}}|[0-9]{{2}})"), ("mdy", rf"{NAME}\.? {DAY},? {YEAR}"), ("clock", "")]
FORMATS = [re.compile(rf"\[?{date}(?:(?:[T_]|,? +|,){CLOCK})?\]?" if date else rf"\[?{CLOCK}\]?") for _, date in DATES]
ORDERS = {"ymd": "year-month-day", "dmy": "day.month.year", "mdy": "month/day/year", "clock": "time of day"}
MONTHS = {month: i for i, months in enumerate("jan,feb,mar mrz mär,apr,may mai,jun,jul,aug,sep,oct okt,nov,dec dez".split(","), 1)
          for month in months.split()}
# Numbers that, in the years 2000 to 2040, can only be times since an origin: (name, seconds of one, s from 1970 to the origin)
EPOCHS = [("unix", "1", 0), ("unix_ms", "1e-3", 0), ("unix_us", "1e-6", 0), ("unix_ns", "1e-9", 0), ("labview", "1", -2082844800),
          ("excel", "86400", -25569 * 86400), ("datenum", "86400", -719529 * 86400), ("filetime", "1e-7", -11644473600),
          ("ticks", "1e-7", -62135596800)]
EPOCH, DAY_NS = datetime.datetime(1970, 1, 1), 86400 * NS


def moment(key, cell):
    """(ns since 1970 or midnight, whether the cell has a zone) by FORMATS[key] or a form of strptime; None if the cell is no such time."""
    with contextlib.suppress(ValueError):
        if isinstance(key, str):
            stamp = datetime.datetime.strptime(cell, key)
            since = stamp.replace(tzinfo=None) - (stamp.utcoffset() or datetime.timedelta()) - EPOCH
            return since // datetime.timedelta(microseconds=1) * 1000, stamp.tzinfo is not None
        found = FORMATS[key].fullmatch(cell)
        part = found.groupdict() if found else {"H": "99"}
        hour, is_clock, half = int(part["H"] or 0), DATES[key][0] == "clock", (part.get("half") or "").lower()
        if not found or half and not 1 <= hour <= 12 or hour > 23 and not is_clock:
            return None
        zone, hour = part["zone"] or "Z", hour % 12 + 12 * (half == "p") if half else hour
        offset_min = 0 if zone[0] in "ZUG" else int(zone[0] + "1") * (int(zone[1:3]) * 60 + int(zone[-2:]))
        seconds = hour * 3600 + (int(part["M"] or 0) - offset_min) * 60 + int(part["S"] or 0)
        if not is_clock:
            month = int(part["m"]) if part["m"].isdigit() else MONTHS.get(part["m"][:3].lower(), 0)
            date = datetime.date(int(part["y"]) + 2000 * (len(part["y"]) == 2), month, int(part["d"]))
            seconds += (date.toordinal() - 719163) * 86400
        return seconds * NS + int((part["f"] or "0").ljust(9, "0")) + int(part["ms"] or 0) * 1_000_000, part["zone"] is not None


class Times(collections.namedtuple("Times", "name ns text is_date zone")):
    """The time of each row: ns since 1970 if `is_date`, else since any origin."""

    def show(self, row):
        seconds, fraction = divmod(self.ns[row] if self.is_date else abs(self.ns[row]), NS)
        text = (EPOCH + datetime.timedelta(seconds=seconds)).isoformat() if self.is_date else f"{'-' * (self.ns[row] < 0)}{seconds}"
        return text + (f".{fraction:09d}".rstrip("0") if fraction else "") + self.zone

    def check(self, lines):
        """Refuses times that go back. Returns the step (span by count between gaps), gaps and repeated stamps as text."""
        def steps():
            return (b - a for a, b in zip(self.ns, itertools.islice(self.ns, 1, None)))

        for row in (row for row, step in enumerate(steps(), 1) if step < 0):
            raise Refused(f"line {lines[row]}: column {self.name}: the time goes back from {self.show(row - 1)} to {self.show(row)}, "
                          "expected increasing times; if a new recording begins here, divide the file at this line")
        span, count = self.ns[-1] - self.ns[0], max(1, len(self.ns) - 1)
        first = sorted(itertools.islice(steps(), 10000)) or [0]
        usual = first[len(first) // 2] or span // count
        gaps, repeated = [step for step in steps() if step > 1.5 * usual + 1_000_000], sum(step == 0 for step in steps())
        step_s = (span - sum(gaps)) / max(1, count - len(gaps)) / NS
        text = f"every {step_s:.9g} s; {len(gaps)} gaps" + f" of {sum(gaps) / NS:.6g} s in all" * bool(gaps)
        return text + f"; {repeated} repeated stamps" * bool(repeated)


def text_times(name, cells, how, lines):
    """The Times of texts."""
    keys = [how] if "%" in how else [n for n, (order, _) in enumerate(DATES) if how in ("", order) and moment(n, cells[0])]
    good, bad_row = [], 0
    for key in keys:
        ns, zones = array.array("q"), set()
        for time in itertools.takewhile(lambda time: time and abs(time[0]) < 1 << 63, (moment(key, cell) for cell in cells)):
            ns.append(time[0])
            zones.add(time[1])
        good += [(key, ns, zones)] * (len(ns) == len(cells))
        bad_row = max(bad_row, len(ns))
    if not good:
        raise Refused(f"line {lines[bad_row]}: column {name}: found \"{cells[bad_row][:40]}\", expected a time; "
                      f"--time \"{name}:%d.%m.%Y %H:%M:%S\" states a form")
    (key, ns, _), zones = good[0], set().union(*(found for _, _, found in good))
    for row in (row for row, times in enumerate(zip(*(found for _, found, _ in good))) if len(set(times)) > 1):
        both = " or ".join(f"{(EPOCH + datetime.timedelta(seconds=found[row] // NS)).date()} (--time \"{name}:{DATES[key][0]}\")" for key, found, _ in good)
        raise Refused(f"line {lines[row]}: column {name}: two readings are possible: \"{cells[row]}\" is {both}")
    check(len(zones) == 1, f"column {name}: found times with a zone and without, expected the same in all rows")
    order = how if "%" in how else DATES[key][0]
    check(order != "clock" or cells[0].count(":") != 1 or how == "clock",
          f"column {name}: two readings are possible: \"{cells[0]}\" is hours and minutes (--time \"{name}:clock\") "
          f"or minutes and seconds (--time \"{name}:%M:%S\")")
    if order == "clock" and max(ns) < DAY_NS:
        midnights = itertools.accumulate((b < a - DAY_NS // 2 for a, b in zip(ns, itertools.islice(ns, 1, None))), initial=0)
        ns = array.array("q", (time + day * DAY_NS for time, day in zip(ns, midnights)))
    is_date, zone = "%y" in order.lower() if "%" in order else order != "clock", "Z" * (True in zones and order != "clock")
    return Times(name, ns, ORDERS.get(order, order) + ", no zone: taken for UTC" * (is_date and not zone), is_date, zone)


def number_times(column, how, lines):
    """The Times of a column of numbers, by their unit or a known origin."""
    how, cells = how or time_unit(column), column.plain()
    factor, unit = re.fullmatch(r"([0-9]+\.?[0-9]*(?:[eE][+-]?[0-9]+)?|)[ *]*(.*)", how).groups()
    unit, first = TIME_UNITS.get(unit), [Decimal(cell) for cell in itertools.islice(cells, SAMPLE_ROWS) if cell]
    step = sorted(b - a for a, b in zip(first, first[1:]))[len(first) // 2 - 1] if len(first) > 1 else Decimal(0)
    found = [(f"a number of {factor} {unit}".replace("  ", " "), SECONDS[unit], None)] if unit else [
        (name + ", taken for UTC", size, origin) for name, size, origin in EPOCHS if how == name or first and not how and
        946684800 < first[0] * Decimal(size) + origin < 2208988800 and (size != "86400" or step < Decimal("2e-4"))]
    check(len(found) == 1, f"column {column.title}: two readings are possible: {'its unit is not known, ' * bool(how)}steps of {step:.4g} may be s, ms or "
          f"another unit; --time \"{column.title}:UNIT\", one of {' '.join([*SECONDS, *(e[0] for e in EPOCHS)])}, as \"1000 s\", or %H%M%S")
    (text, size, origin), size = found[0], Decimal(found[0][1]) * Decimal(factor or 1) * NS
    ns, is_date = array.array("q"), origin is not None
    for cell in cells:
        time = int((Decimal(cell or "1e99") * size).to_integral_value()) + (origin or 0) * NS
        check(abs(time) < 1 << 63, f"line {lines[len(ns)]}: column {column.title}: found \"{cell}\", expected a time below 292 years in each row")
        ns.append(time)
    return Times(column.title, ns, text, is_date, "Z" * is_date)


def find_time(table, options):
    """(Times, its columns) of --interval, --time or the one column that has times."""
    columns, first = table.columns, {column: column.cells[0] for column in table.columns}
    if options.interval:
        return Times("time", array.array("q", (int(i * options.interval * NS) for i in range(len(table.lines)))), "rows at the stated interval", False, ""), []
    if options.time:
        name, _, how = (options.time, "", "") if table.locate(options.time) else options.time.partition(":")
        parts = [table.locate(part) for part in ([name] if table.locate(name) else name.split("+"))]
        check(all(parts), f"--time: found \"{options.time}\", expected COLUMN[+COLUMN][:FORM] with one of {table.names}")
    else:
        *dates, clock = ([c for c in columns if moment(key, first[c])] for key in range(len(DATES)))
        dates = [c for c in columns if any(c in found for found in dates)]
        named = [c for c in columns if c.is_number and (time_unit(c) and c.bare not in ("ms", "us") or TIME_NAME.search(c.bare.split(".")[-1]))]
        found = dates or clock or named
        found = len(found) > 1 and [c for c in found if c.bare.strip("_").lower() in ("time", "timestamp")] or found
        check(len(found) == 1, f"found {'several columns' if found else 'no column'} of times in {table.names}; expected one; "
                               "--time COLUMN:UNIT (as s), or --interval SECONDS")
        after = columns[found[0].number:] + [None, None]
        parts, how = found + after[:1] * (after[0] in clock and found[0] in dates and ":" not in first[found[0]]), ""
        fraction, name = after[len(parts) - 1], "+".join(column.title for column in parts)
        if fraction and fraction.fraction and found[0] not in named and "." not in first[parts[-1]]:
            both = f"the fraction of the seconds before it (--time \"{name}+{fraction.title}\") or not (--time \"{name}\")"
            raise Refused(f"column {fraction.title}: two readings are possible: {both}")
    if len(parts) == 1 and parts[0].is_number and "%" not in how:
        return number_times(parts[0], how, table.lines), parts
    joined = zip(parts[0].cells, *([f".{cell:0>{c.fraction}}" if c.fraction else " " + cell for cell in c.cells] for c in parts[1:]))
    cells = Cells("".join(row).replace("[", "").replace("]", "") for row in joined)
    return text_times("+".join(column.title for column in parts), cells, how, table.lines), parts


def kind(cell):
    """"": missing; "v": a number or time; "s": numbers with another separator; "x": another text."""
    form = re.sub(r"^([+\-\u2212]) *", "", form_of(cell.strip()))
    if cell.strip().lower() in HOLES:
        return ""
    if decimal_signs(form) or any(expression.fullmatch(cell.strip()) for expression in FORMATS):
        return "v"
    return "s" if re.fullmatch(r"[-+09.,;|:/eE\t ]*[09][-+09.,;|:/eE\t ]*", form) or re.search(r"[,;|\t] *[+-]?[09][09.]*([,;|\t]|$)", form) else "x"


def find_table(text, all_rows, options, notes=(), comments=(), units=(), signs=frozenset()):
    """The Table in an iterator of rows (line, cells); the first of them show where names, units and values are. `comments`: rows that may have the names."""
    def is_units(cells):  # most of them
        found = [cell[0] in "[(" or cell.lower() in {*UNITS, *TIME_UNITS} or bool(NO_UNITS.fullmatch(cell.lower())) for cell in cells if cell]
        return 2 * sum(found) > len(found)

    sample, missing = list(itertools.islice(all_rows, SAMPLE_ROWS)), set(options.missing)
    rows = [(line, [cell.strip() for cell in cells], [kind(cell) for cell in cells]) for line, cells in sample if any(map(str.strip, cells))]
    names, header = next((cells for line, cells, _ in rows if line == options.header_row), []), options.header_row or 0
    rows, begin = [row for row in rows if row[0] > header], options.first_row or 0
    widths = collections.Counter(len(kinds) for line, _, kinds in rows if "v" in kinds and line >= begin)
    check(widths, "found no row of numbers" + (" below a line of names" if rows else ": the file is empty"))
    width, count = widths.most_common(1)[0]
    seen = [collections.Counter(column) for column in zip(*[kinds for _, _, kinds in rows if len(kinds) == width][-max(1, count // 2):])]
    texts = {c for c, column in enumerate(seen) if column["x"] + column["s"] > column["v"]}
    used = [c for c, column in enumerate(seen) if column.total() > column[""]]
    wrong = {line: [c for c, k in enumerate(kinds) if k in ("x", "s") and c not in texts] for line, _, kinds in rows}
    first = next((line for line, _, kinds in rows if len(kinds) == width and "v" in kinds and line >= begin and (begin or not wrong[line])), None)
    check(first and used and all(column["s"] <= column["v"] + column["x"] for column in seen),
          "found no rows of numbers that are alike; state --separator, --header-row or --first-row, or --hex for a hex dump")
    above = [row for row in rows if row[0] < first]
    if options.header_row is None:
        full = [(line, cells) for line, cells, kinds in above if len(cells) > used[-1] and all(cells[c] for c in used) and "v" not in kinds]
        full = full[:1] + [row for row in full[1:] if not is_units(row[1])]
        both = " or ".join(f"{', '.join(cells[:4])} (--header-row {line})" for line, cells in full[:2])
        check(len(full) < 2, f"found two lines of names, expected one: {both}")
        # Names in a comment: numpy ("# t rate") and ROS ("%time,rate").
        marked = [names for cells in comments for names in ([cells[0].lstrip("#%/ ")] + cells[1:], cells[1:])
                  if len(names) == width and all(names) and "v" not in map(kind, names)]
        header, names = full[0] if full else (0, marked[0] if marked else [])
    between = [row for row in above if row[0] > header]
    for line, cells, kinds in between if not begin else ():
        check(not any(k == "v" and c not in texts for c, k in enumerate(kinds)),
              f"line {line}: found \"{' '.join(cells)[:40]}\", expected {width} fields and numbers as in line {first}; if the rows begin "
              "below: --first-row LINE; if this line has the names: --header-row LINE")
    for line, cells, kinds in above[::-1] if not names and options.header_row is None else ():
        check("v" in kinds or len(cells) < 2, f"line {first}: found {width} fields, expected {len(cells)} as in line {line}; --header-row LINE, 0: no names")
    units = next((["" if NO_UNITS.fullmatch(cell.lower()) else cell.strip("[]() ") for cell in cells]
                  for _, cells, _ in between if names and is_units(cells)), units)
    again = names if "v" not in map(kind, names) else []  # the names, once more
    names, units = ((list(row) + [""] * width)[:width] for row in (names, units))

    def data():
        for line, cells in itertools.chain(sample, all_rows):
            if line >= first and any(cells) and cells != again:
                check(len(cells) == width, f"line {line}: found {len(cells)} fields, expected {width}")
                yield line, ["" if cell.strip() in missing else cell for cell in cells]

    text += f"names in line {header}" if header else "names in a comment" if any(names) else "no names"
    return Table(text, names, units, data(), signs, notes)


SEPARATORS = {"tab": "\t", "semicolon": ";", "bar": "|", "comma": ",", "blank": " ", "none": ""}


def open_text(path, encoding, notes):
    """(encoding, function that begins to read the lines, the number of those with an end)."""
    def lines():
        with open(path, encoding=encoding, errors=errors, newline="") as file:
            yield from file

    def count():
        number, line = 0, "\n"
        for number, line in enumerate(lines(), 1):
            check("\0" not in line, f"line {number}: found a NUL byte, expected text; state --encoding, as utf-16-le or utf-32")
        return number - (line[-1] not in "\r\n")

    with open(path, "rb") as file:
        is_wide = file.read(2) in (b"\xff\xfe", b"\xfe\xff")
    encoding, errors = encoding or ("utf-16" if is_wide else "utf-8-sig"), "strict"
    try:
        return encoding, lines, count()
    except (UnicodeError, LookupError) as error:
        if encoding != "utf-8-sig":
            raise Refused(f"is not text in {encoding} ({error}); state --encoding, as cp1252 or iso-8859-2") from None
    encoding, errors = "cp1252", "replace"
    notes.append("not UTF-8: names are read as Windows-1252; --encoding states another one")
    return encoding, lines, count()


def split(lines, separator, begin):
    """(line, cells) below the line `begin`."""
    if separator in (" ", ""):
        for number, line in enumerate(lines, 1):
            if number > begin and line.strip():
                yield number, line.split() if separator else [line.strip()]
        return
    reader, before = csv.reader(lines, delimiter=separator, strict=True, skipinitialspace=separator != "\t"), 0
    try:
        for cells in reader:
            if reader.line_num > before + 20:
                raise csv.Error("a cell over 20 lines")
            if cells and before >= begin:
                yield before + 1, cells
            before = reader.line_num
    except csv.Error as error:
        raise Refused(f"line {before + 1}: found a quote that is not closed ({error})") from None


def read_text(path, options):
    """The Table of a text with any separator."""
    notes, mark = [], r"\s*(#(?!N/A|NUM!|VALUE!|DIV/0!|REF!|WERT!)|%|//)"
    encoding, lines, count = open_text(path, options.encoding, notes)
    head = list(itertools.islice(lines(), min(count, SAMPLE_ROWS)))
    if any(True for _ in itertools.islice(lines(), count, None)):
        notes.append(f"line {count + 1} has no line end and may be cut: not used; if it is complete, add a line end")
    sep = re.match("sep=(.)[\r\n]+$", head[0]) if head else None
    comments = [line.strip() for line in head if re.match(mark, line)]

    end = max((number for number, line in enumerate(head, 1) if line.startswith("***End_of_Header***")), default=0)  # LabVIEW
    comment_line = next((line for line in head[end:end + 1] if end and line.rstrip().endswith("Comment")), "")  # a column that few rows have
    stated = SEPARATORS.get(options.separator, options.separator or (sep and sep[1]))

    def without_comments(lines):
        return ("\n" if re.match(mark, line) or sep and number == 0 else line for number, line in enumerate(lines))

    def checked(rows, separator):
        width = comment_line.count(separator) if comment_line else 0
        for line, cells in rows:
            number = next((cell for cell in cells[width:] if width and kind(cell) == "v"), None)
            check(number is None, f"line {line}: found the number \"{number}\" in the column Comment, expected a text: was a number divided?")
            yield line, cells[:width] if width else cells

    def table_of(rows, separator):
        units = next((line.rstrip("\r\n").split(separator or None) for line in head[:end] if line.startswith("Y_Unit_Label")), [""])
        name = next((name for name, mark in SEPARATORS.items() if mark == separator), separator)
        marked = [cells for line in comments[::-1] for _, cells in split([line], separator, 0)]
        signs = {"."} if separator == "," else frozenset()
        return find_table(f"{encoding}, separator {name}, ", checked(rows, separator), options, notes, marked, ["", *units[1:]], signs)

    good, bad = {}, []
    for separator in SEPARATORS.values() if stated is None else [stated]:
        rows = []
        try:
            rows += split(without_comments(head), separator, end)
            table = table_of(iter(rows), separator)
            if len(table.columns) > 1 or not separator or stated is not None:
                good[separator] = table
        except Refused as error:
            bad.append((sum(kind(cell) == "v" for _, cells in rows[:100] for cell in cells), "quote" in str(error), -len(bad), error))
    sure = [separator for separator in good if separator in ("\t", ";", "|")][:1] or list(good)  # these are in no number
    if not sure:
        raise max(bad)[-1] if bad else Refused("found no rows of numbers; state --separator")
    if len(sure) > 1:
        both = " or ".join(f"{len(good[mark].columns)} columns (--separator {name})" for name, mark in SEPARATORS.items() if mark in sure)
        raise Refused(f"line {(first := good[sure[0]].lines[0])}: two readings are possible: \"{head[first - 1].strip()[:40]}\" has {both}")
    return table_of(split(without_comments(itertools.islice(lines(), count)), sure[0], end), sure[0])


def check_inflated(path, size):
    """Refuses a file that inflates to more than files of measurements do: 64 MiB and 100 times its size."""
    most = max(64 << 20, 100 * os.path.getsize(path))
    check(size <= most, f"inflates to {size >> 20} MiB, expected at most {most >> 20} MiB of a file of {os.path.getsize(path)} bytes")


def read_workbook(path, options):
    """The Table of a sheet of an Excel file."""
    def text(value):
        value = value.total_seconds() if isinstance(value, datetime.timedelta) else "" if value is None else value
        cell = value.isoformat() if hasattr(value, "isoformat") else value if isinstance(value, str) else repr(value)
        return cell + "0" if isinstance(value, float) and EITHER.fullmatch(form_of(cell)) else cell  # a number has no groups

    import openpyxl
    with zipfile.ZipFile(path) as archive:
        check_inflated(path, sum(entry.file_size for entry in archive.infolist()))
        check(not archive.testzip(), "is damaged: a checksum does not hold")
    book = openpyxl.load_workbook(path, read_only=True, data_only=True)
    widths = {sheet: [len(row) for row in sheet.iter_rows(values_only=True) if any(value is not None for value in row)] for sheet in book.worksheets
              if options.sheet in (None, sheet.title)}
    filled = {sheet: max(lengths) for sheet, lengths in widths.items() if len(lengths) > 1}
    names = "the sheets " + ", ".join(sheet.title for sheet in filled) if filled else "no sheet with rows"
    check(len(filled) == 1, f"found {names}, expected one; --sheet NAME")
    (sheet, width), = filled.items()
    rows = ((line, [text(value) for value in row] + [""] * (width - len(row))) for line, row in enumerate(sheet.iter_rows(values_only=True), 1))
    return find_table(f"Excel, sheet {sheet.title}, ", rows, options)


def read_mat(path, options):
    """The Table of a MATLAB file: vectors, and columns of matrices of either orientation, of the length of the time."""
    notes, vectors = [], {}
    is_hdf5 = b"\x89HDF\r\n\x1a\n" in pathlib.Path(path).read_bytes()[:520]
    for name, values in list((hdf5_variables if is_hdf5 else level5_variables)(path, notes)):
        rows, columns = values.shape
        notes.append(f"{name}: {rows} x {columns}" + ", not used: as many rows as columns" * (rows == columns > 1))
        for c, column in enumerate(values.T if rows > columns else values if rows < columns else ()):
            vectors[f"{name}({c + 1})" if min(rows, columns) > 1 else name] = column
    stated = re.split("[:+,]", options.time or ",".join(options.columns))[0]
    lengths = {len(vectors[stated])} if stated in vectors else set(map(len, vectors.values()))
    check(len(lengths) == 1, f"found {'variables of several lengths' if vectors else 'no vector of numbers'}, expected one; "
          f"--time NAME:UNIT states the length; {'; '.join(notes)}")
    length, = lengths
    vectors = {name: values for name, values in vectors.items() if len(values) == length}
    rows = enumerate(zip(*((repr(value.item()) for value in values) for values in vectors.values())), 1)
    return Table("MATLAB file", vectors, [], rows, {"."}, notes)


MAT_TYPES = {1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 9: "f8", 12: "i8", 13: "u8"}
# Class: (name, types of its numbers). MATLAB stores doubles as shorter integers if they are integers.
MAT_CLASSES = {1: ("cell", ()), 2: ("struct", ()), 4: ("text", ()), 5: ("sparse", ()), 6: ("double", (9, 1, 2, 3, 4, 5, 6)), 7: ("single", (7, 1, 2, 3, 4)),
               **{8 + i: (f"{'u' * (i % 2)}int{8 << i // 2}", (1, 2, 3, 4, 5, 6, 12, 13)) for i in range(8)}}


def level5_variables(path, notes):
    """(name, matrix) of the numeric arrays of level 5. Each element must be inside its parent and have the length that its contents need."""
    import numpy
    whole = memoryview(pathlib.Path(path).read_bytes())
    order = {b"\0\1IM": "<", b"\1\0MI": ">"}.get(bytes(whole[124:128]))
    check(order, "has no header of MATLAB")

    def number(data, at):
        return int.from_bytes(data[at:at + 4], "little" if order == "<" else "big")

    def elements(data):
        """(type, bytes) of the elements that fill `data`."""
        at = 0
        while at < len(data):
            type_, size, begin = number(data, at), number(data, at + 4), at + 8
            end = begin + (size if type_ == 15 else (size + 7) // 8 * 8)
            if type_ >> 16:
                type_, size, begin, end = type_ & 0xFFFF, type_ >> 16, at + 4, at + 8  # a small element
            check(begin + size <= min(len(data), end), "is cut: an element is longer than the file or its parent")
            yield type_, data[begin:begin + size]
            at = end

    def matrices(element, prefix=""):
        """(name, matrix) of an array, or of the fields of a struct as "struct.field"."""
        type_, data = element
        if type_ == 15:
            stream = zlib.decompressobj()
            head = stream.decompress(data, 8)
            check_inflated(path, size := number(head, 4) + 8)
            data = memoryview(head + stream.decompress(stream.unconsumed_tail, size))
            check(len(data) == size and stream.eof, "is damaged: a compressed variable has another length than it states")
        parts = list(elements(data))
        for part in parts if type_ == 15 else ():
            yield from matrices(part)
        if type_ == 15 or not parts:  # an empty field
            return
        check(type_ == 14 and len(parts) > 2 and parts[0][0] == 6 and len(parts[0][1]) == 8, "is damaged: an array has no flags")
        flags, label = number(parts[0][1], 0), prefix + bytes(parts[2][1]).decode("ascii", "replace")
        name, types = MAT_CLASSES.get(flags & 0xFF, ("object of MATLAB (save its numbers, as s.time = ts.Time)", ()))
        shape = numpy.frombuffer(parts[1][1], order + "i4").tolist() if parts[1][0] == 5 else []
        if name == "struct" and shape == [1, 1] and len(parts) > 4:
            width, names = number(parts[3][1], 0) or 1, bytes(parts[4][1]).decode("ascii", "replace")
            check(len(names) == width * (len(parts) - 5), "is damaged: a struct has other fields than it states")
            for i, value in enumerate(parts[5:]):
                yield from matrices(value, f"{label}.{names[i * width:(i + 1) * width]}".split("\0")[0])
        elif not types or flags & 0x800 or parts[1][0] == 5 and len(shape) != 2:
            notes.append(f"{label or 'a variable'}: {'complex ' * (flags >> 11 & 1)}{name}, not used")
        else:
            check(len(shape) == 2 and len(parts) == 4 and parts[3][0] in types, "is damaged: an array has numbers of an unknown type")
            values = numpy.frombuffer(parts[3][1], order + MAT_TYPES[parts[3][0]])
            check(min(shape) >= 0 and len(values) == shape[0] * shape[1], "is damaged: an array has another number of values than it states")
            yield label, values.reshape(shape, order="F")

    for element in elements(whole[128:]):
        yield from matrices(element)


def hdf5_variables(path, notes):
    """(name, matrix) of the numeric datasets of version 7.3. Each chunk is read and inflated by itself: HDF5 has no checksums, and fills in
    zeros for a chunk that it does not find."""
    import h5py, numpy
    types, names = [h5py.h5t.py_create(numpy.dtype(name)) for name in "<i1 <i2 <i4 <i8 <u1 <u2 <u4 <u8 <f4 <f8".split()], []
    with h5py.File(path, "r") as file:
        file.visit(names.append)
        for name, item in ((name, file[name]) for name in names if not name.startswith("#")):
            if not isinstance(item, h5py.Dataset):
                continue
            class_, chunk = item.attrs.get("MATLAB_class", b"double").decode(), item.chunks or item.shape
            if not dict(MAT_CLASSES.values()).get(class_) or len(item.shape) != 2 or item.dtype.kind not in "iuf" or "MATLAB_empty" in item.attrs:
                notes.append(f"{name}: {class_}, not used")
                continue
            check_inflated(path, max(item.nbytes, item.dtype.itemsize * math.prod(chunk)))
            is_plain = item.compression == "gzip" if item.chunks else item.id.get_storage_size() == item.nbytes
            check(is_plain and any(map(item.id.get_type().equal, types)) and not item.shuffle and not item.fletcher32, f"{name} has an unknown form")
            values = numpy.empty(item.shape, item.dtype) if item.chunks else item[()]
            for place in itertools.product(*(range(0, length, step) for length, step in zip(item.shape, chunk))) if item.chunks else ():
                (left_out, packed), stream = item.id.read_direct_chunk(place), zlib.decompressobj()
                data = stream.decompress(packed, item.dtype.itemsize * math.prod(chunk) + 1)
                check(not left_out and len(data) == item.dtype.itemsize * math.prod(chunk) and stream.eof, f"is damaged: {name} is incomplete")
                area = tuple(slice(begin, begin + step) for begin, step in zip(place, chunk))
                values[area] = numpy.frombuffer(data, item.dtype).reshape(chunk)[tuple(slice(0, n) for n in values[area].shape)]
            yield name.replace("/", "."), values.T


OTHER_FILES = {b"\xd0\xcf\x11\xe0": "an old Excel file (.xls); in Excel: save it as .xlsx", b"TDSm": "a TDMS file of LabVIEW; export it as text",
               b"ULog": "a ULog of PX4; export it by ulog2csv FILE", b"#ROSBAG": "a bag of ROS; rostopic echo -b FILE -p /TOPIC > out.csv",
               b"\x89MCAP": "an MCAP file of ROS 2; ros2 topic echo --csv /TOPIC > out.csv", b"\x1f\x8b": "compressed by gzip; gunzip FILE",
               b"# prism ": "a log of prismd, which prismcal reads"}


def read_table(path, options):
    head = pathlib.Path(path).read_bytes()[:512]
    check(head.strip(), "found no row of numbers: the file is empty")
    for what in (what for mark, what in OTHER_FILES.items() if head.startswith(mark)):
        raise Refused(f"is {what}")
    is_mat = head.startswith((b"MATLAB 5.0", b"MATLAB 7.3", b"\x89HDF")) or path.lower().endswith(".mat")
    if not is_mat and not head.startswith(b"PK\x03\x04"):
        return read_text(path, options)
    try:
        return (read_mat if is_mat else read_workbook)(path, options)
    except (Refused, MemoryError):
        raise
    except ImportError as error:
        raise Refused(f"needs python3-{error.name}: apt install python3-{error.name}") from None
    except Exception as error:  # a reader's, of any type
        raise Refused(f"is damaged or no {'MATLAB file (.mat)' if is_mat else 'Excel file (.xlsx)'}: {str(error)[:120] or type(error).__name__}") from None


BYTES = re.compile(r"(?:0[xX])?((?:[0-9A-Fa-f]{2})+)[hH]?")
SENTENCE = re.compile(r"([$!#%][^$*]{2,})\*([0-9A-Fa-f]{8}|[0-9A-Fa-f]{4}|[0-9A-Fa-f]{2})$")
STAMP = re.compile(r"(?i)[\[(]?[0-9][0-9:./T+-]{3,}Z?[\])]?:?|-|\[?[rt]x\]?:?|<|>|<--|-->")  # words before the bytes
DIRECTIONS = {"<": "rx", "rx": "rx", "<--": "rx", ">": "tx", "tx": "tx", "-->": "tx"}


def bytes_of(line, is_log):
    """(offset or None, direction or None, bytes) of a line of a hex dump or a log of sentences; the bytes are None for another line."""
    if is_log:  # a checksum of two digits must hold
        text, digits = SENTENCE.search(line).groups() if SENTENCE.search(line) else ("", "00")
        is_good = len(digits) > 2 or int(digits, 16) == functools.reduce(lambda a, b: a ^ b, text[1:].encode("latin-1", "replace"), 0)
        return None, None, f"{text}*{digits}\r\n".encode("latin-1", "replace") if text and is_good else None
    offset = re.match(r"([0-9A-Fa-f]{6,16})(:|  |$)", line)
    if offset:
        line = line[offset.end():].split("|")[0] if offset[2] != ":" else re.split(r"(?<=\S)  ", line[offset.end():], maxsplit=1)[0]
    words = re.sub(r"[,;]", " ", line).split()
    direction = next((DIRECTIONS[word.strip("[]:").lower()] for word in words if word.strip("[]:").lower() in DIRECTIONS), None)
    if direction and "length=" in line:
        return None, direction, b""  # socat -x
    digits = [BYTES.fullmatch(word)[1] for word in itertools.takewhile(BYTES.fullmatch, reversed(words))][::-1]
    before = words[:len(words) - len(digits)]
    is_bytes = digits and ({*map(len, digits)} == {2} or len(digits) == 1 and len(digits[0]) >= 32)  # or bytes without blanks between them
    is_dump = not before if offset else all(map(STAMP.fullmatch, before)) and is_bytes
    return offset and int(offset[1], 16), direction, bytes.fromhex("".join(digits)) if is_dump else None


def convert_hex(path, options):
    """Writes the bytes that a hex dump or a log of sentences shows."""
    lines = [(number, line.rstrip()) for number, line in enumerate(open_text(path, options.encoding, [])[1](), 1) if line.strip()]
    head = lines[:200]
    is_log = 2 * sum(bytes_of(line, True)[2] is not None for _, line in head) > len(head)
    found, skipped, direction, last, repeats, base = collections.defaultdict(bytearray), [], None, b"", False, None
    for number, line in lines:
        offset, stated, data = bytes_of(line, is_log)
        direction = stated or direction
        if line == "*" and last:
            repeats = True
            continue
        if data is None or base is not None and offset is None:  # or a line that lost its offset
            if last and not options.lenient:
                expected = "a sentence with a good checksum" if is_log else "bytes in hex"
                raise Refused(f"line {number}: found \"{line[:40]}\", expected {expected}; --lenient leaves such lines out")
            skipped.append(number)
            continue
        base, target = offset if base is None else base, found[direction]
        while repeats and offset is not None and len(target) < min(offset - base, 1 << 30):
            target += last
        if offset is not None and offset - base != len(target):
            raise Refused(f"line {number}: found the offset {offset:x}, expected {base + len(target):x}: lines are missing")
        target += data
        last, repeats = data or last, False
    sizes = [f"{len(data)} bytes (--direction {key})" for key, data in found.items() if data]
    check(len(sizes) < 2 or options.direction, f"found two directions, expected one: {' or '.join(sizes)}")
    data = bytes(found[options.direction] if options.direction else b"".join(found.values()))
    check(data and (is_log or direction or base is not None or re.search("[a-f]", data.hex())),
          f"found {'decimal numbers' if data else 'no bytes in hex'}, expected a dump with offsets or hex letters, or sentences ($...*HH)")
    write(options, [data], [f"{path}: {len(data)} bytes, {'sentences' if is_log else 'hex dump'}, {len(lines) - len(skipped)} lines"]
          + [f"lines without bytes: {', '.join(map(str, skipped[:9]))}{' …' * (len(skipped) > 9)}"] * bool(skipped))


def write(options, parts, lines):
    """Prints how the file was understood, and writes all of --out or nothing; "-" is stdout."""
    if options.out == "-":
        sys.stdout.buffer.writelines(parts)
    elif options.out:
        with open(options.part, "wb") as file:
            file.writelines(parts)
        os.replace(options.part, options.out)
    print("\n  ".join(lines), file=sys.stderr if options.out == "-" else sys.stdout)


def convert(path, options):
    """Reads a table, writes it, and prints how it was understood."""
    def describe(title, column, values):  # first and last value, and the step of the values if some are missing
        known = array.array("q", (row for row, value in enumerate(values) if value)) or [0]
        first, last = values[known[0]], values[known[-1]]
        step_s = (times.ns[known[-1]] - times.ns[known[0]]) / max(1, len(known) - 1) / NS
        missing = sum(not value for value in values)
        holes = f"; {missing} missing, a value every {step_s:.6g} s" if missing else ""
        return f"{title}: {first} to {last}{holes}" + "; decimal comma" * (column.sign == ",")

    table = read_table(path, options)
    check(table.lines, "found no row of numbers below the names")
    kept, stated = [], {}
    for part in [part.strip() for text in options.columns for part in ([text] if table.locate(text) else text.split(","))]:
        kept.append(table.locate(part))
        check(kept[-1], f"--columns: found \"{part}\", expected names or numbers of {table.names}")
    for text in options.decimal:
        name, _, sign = text.rpartition(":")
        check(sign in {".", ","} and (not name or table.locate(name)), f"--decimal: found \"{text}\", expected . or , or COLUMN: and one of them")
        stated.update({column: sign for column in ([table.locate(name)] if name else table.columns)})
    check(all(column.title != "_field" or len(set(column.cells)) == 1 for column in table.columns),
          "column _field: found several quantities (InfluxDB), expected a column for each; in Flux: "
          "|> pivot(rowKey: [\"_time\"], columnKey: [\"_field\"], valueColumn: \"_value\")")
    numbers = [column for column in table.columns if column.is_number]
    signs = {sign for column in numbers for sign in column.evidence} or table.signs
    for column in numbers:
        column.choose_sign(stated.get(column), signs, table.lines)
    times, parts = find_time(table, options)
    texts, kept = ([column for column in kept or table.columns if column not in parts and column.is_number == wanted] for wanted in (False, True))
    check(kept, f"found no column of numbers besides the time, expected one of {table.names}")
    values = [column.plain(() if options.lenient else table.lines) for column in kept]
    titles = [column.title if [c.title for c in kept].count(column.title) == 1 else f"{column.title} (column {column.number})" for column in kept]
    def parts():
        names = ["time" if times.is_date else "time_s"] + titles
        yield (",".join(f'"{name.replace(QUOTE, 2 * QUOTE)}"' if re.search('[",]', name) else name for name in names) + "\n").encode()
        for row, cells in enumerate(zip(*values)):
            yield f"{times.show(row)},{','.join(cells)}\n".encode()

    write(options, parts(), [
        f"{path}: {table.text}; {len(table.lines)} rows, lines {table.lines[0]} to {table.lines[-1]}",
        f"time: {times.name}: {times.text}; {times.show(0)} to {times.show(-1)}; {times.check(table.lines)}",
        *map(describe, titles, kept, values),
        *[f"not used: text in {', '.join(column.title for column in texts)}"] * bool(texts), *table.notes])


def guarded(work, path, options):
    """Runs the work in a process of its own with limits, so that a damaged file ends with one line whatever a library does."""
    size, options.part = os.path.getsize(path), f"{options.out}.{os.getpid()}.part"
    memory, seconds = (2 << 30) + 6 * size, 60 + size // 20000
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    child, message, code = os.fork(), "", 1
    if child == 0:
        for limit, value in ((resource.RLIMIT_AS, memory), (resource.RLIMIT_CPU, seconds), (resource.RLIMIT_CORE, 0)):
            resource.setrlimit(limit, (value, value + 5 * (limit == resource.RLIMIT_CPU)))
        warnings.simplefilter("ignore")
        sys.stdout.reconfigure(errors="replace")
        try:
            work(path, options)
            sys.stdout.flush()
            os._exit(0)
        except Refused as error:
            message = f"{path}: {error}"
        except MemoryError:
            message = f"{path}: needs more than {memory >> 20} MiB, the limit for a file of {size} bytes"
        except OSError as error:
            message = f"{(options.out or path) if error.filename in (None, options.part) else error.filename}: {error.strerror or error}"
        except Exception as error:  # a fault of this program
            message, code = f"{path}: {type(error).__name__}: {error}; please report it with the file", 70
        print(f"prism-import: {' '.join(message.split())}", file=sys.stderr, flush=True)
        os._exit(code)
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: os.kill(child, signal.SIGTERM))
    end = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
    pathlib.Path(options.part).unlink(missing_ok=True)
    if end < 0 and end not in (-signal.SIGINT, -signal.SIGTERM):
        why = f"takes more than {seconds} s" if end == -signal.SIGXCPU else f"is damaged: its reader ended with {signal.Signals(-end).name}"
        print(f"prism-import: {path}: {why}", file=sys.stderr)
        return 1
    return end if end >= 0 else 128 - end


OPTIONS = """
--out FILE  write the plain table; - is stdout (default: only show how the file is understood)
--time COLUMN:FORM  column of the time, or COLUMN+COLUMN; FORM is its unit, the order of the date (dmy, mdy, ymd) or as %%d.%%m.%%Y %%H:%%M:%%S
--interval SECONDS  seconds between rows, for a table without a time
--columns LIST  write only these columns, by name or number (repeat)
--decimal SIGN  decimal sign, . or , or COLUMN:SIGN for one column (repeat)
--missing TEXT  a cell with this text is missing (repeat)
--lenient  a cell with another text than a number is missing; with --hex, a line without bytes is left out
--separator SIGN  comma, semicolon, tab, blank, bar, none or one character
--encoding NAME  of a text, as cp1252 or utf-16-le
--header-row LINE  line of the names; 0: none
--first-row LINE  first line with values
--sheet NAME  sheet of an Excel file
--hex  write the bytes of a hex dump or of a log of sentences ($...*HH)
--direction RX|TX  with --hex, if the dump has both: rx or tx"""
EXAMPLES = "\n  prism-import ".join(("Examples:", "export.xlsx", "chamber.csv --time Time:s --out chamber-plain.csv", "terminal.log --hex --out line.bin"))


def main(arguments):
    parser = argparse.ArgumentParser(prog="prism-import", usage="prism-import FILE [--out TABLE.csv] [OPTIONS]", allow_abbrev=False, add_help=False,
                                     description="read a table of another program (CSV, Excel, MATLAB) and write a plain table for prismcal",
                                     formatter_class=lambda prog: argparse.RawDescriptionHelpFormatter(prog, 2, 30, 150), epilog=EXAMPLES)
    parser.add_argument("file", metavar="FILE", help=argparse.SUPPRESS)
    group = parser.add_argument_group("Options")
    group.add_argument("--help", action="help", help="print this help message and exit")
    for line in OPTIONS.strip().split("\n"):
        name, value, text = re.fullmatch(r"(\S+)(?: (\S+))?  +(.*)", line).groups()
        more = {"LINE": {"type": int}, "SECONDS": {"type": float}, "RX|TX": {"choices": ("rx", "tx")}, None: {"action": "store_true"}}.get(value, {})
        more = {"action": "append", "default": []} if "(repeat)" in text else more
        group.add_argument(name, help=text, **more, **({"metavar": value} if value else {}))
    parser.error = lambda message: parser.exit(64, f"prism-import: {message}; see prism-import --help\n")
    options = parser.parse_args(arguments)
    if len(SEPARATORS.get(options.separator, options.separator or "")) > 1:
        parser.error(f"--separator: found \"{options.separator}\", expected {', '.join(SEPARATORS)} or one character")
    if not os.path.isfile(options.file) or options.out and os.path.exists(options.out) and os.path.samefile(options.file, options.out):
        parser.exit(1, f"prism-import: {options.file}: is {'also --out' if os.path.isfile(options.file) else 'no regular file'}, expected another file\n")
    return guarded(convert_hex if options.hex else convert, options.file, options)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
