#!/usr/bin/python3
# SPDX-License-Identifier: MIT
"""prism-import: a table of another program (CSV of any kind, Excel, MATLAB) to a plain table for prismcal; hex text to bytes.

From the end of this file upward: convert() reads a Table of text; the forms of a column's cells ("8,41" has the form "0,00") decide how they
are read; one column is the time. Numbers stay text: only signs, points and commas change. If two readings are possible, an option decides."""
import argparse, array, codecs, collections, contextlib, csv, datetime, functools, itertools, math, os, re, resource, signal, stat, sys, warnings, zipfile, zlib
from decimal import Decimal

BLOCK_ROWS, SAMPLE_ROWS, FORMS_MAX = 20000, 1000, 20000
INFLATED, INFLATED_FREE = 100, 64 << 20  # a compressed file holds at most 100 times its size, or 64 MiB
NS = 1_000_000_000


class Refused(Exception):
    """The file is not converted: "place: finding, expectation, advice"."""


# ---- Numbers: one column of text ----

HOLES = set("nan -nan +nan nan(ind) -nan(ind) na n/a #n/a - -- null none nil ? inf +inf -inf infinity -infinity #num! #value! #div/0! #wert! #ref! "
            "0.#qnan -0.#ind 0.#inf -0.#inf".split()) | {""}
TO_FORM = str.maketrans("123456789", "000000000")
GROUPS = "'\u2019 \u00a0\u202f"  # between groups of three digits, besides a point or comma
NUMBERS = {sign: re.compile(rf"[+-]?(?:(?:0+{mark}?0*|{mark}0+)(?:[eE][+-]?0{{1,3}})?|0{{1,3}}(?P<g>[{other}{GROUPS}])000(?:(?P=g)000)*(?:{mark}0*)?)")
           for sign, mark, other in ((".", r"\.", ","), (",", ",", r"\."))}
AS_IT_IS = re.compile(r"-?0+(\.0+)?([eE][+-]?0{1,3})?")
EITHER = re.compile(r"[+-]?0{1,3}[.,]000")  # 1.234 and 1,234: decimals, or 1234 with grouped digits


@functools.lru_cache(maxsize=1 << 16)
def decimal_signs(form):
    """The decimal signs with which a form is a number: ".", ",", both or none."""
    return "".join(sign for sign in ".," if len(form) < 64 and NUMBERS[sign].fullmatch(form))


def plain_number(cell, sign):
    """The number with a decimal point, without groups and plus."""
    for group in GROUPS + (".," if sign == "," else ",").replace(sign, ""):
        cell = cell.replace(group, "")
    return re.sub(r"\.(?![0-9])", "", re.sub(r"(?<![0-9])\.", "0.", cell.replace(sign, ".").lstrip("+")))


def tidy(cells):
    """One text of the cells, without blanks around them or behind a sign, with the minus of ASCII."""
    text = "\n".join([cell.strip() for cell in cells]).replace("\u2212", "-")
    return re.sub(r"(?m)^([+-]) +(?=[0-9])", r"\1", text) if "+ " in text or "- " in text else text


class Column:
    """Blocks of cells, each block a text with a cell in each line."""

    def __init__(self, number, name, unit=""):
        name = " ".join(re.sub(r"[\x00-\x1f\x7f-\x9f]", " ", name).split())
        if unit and split_unit(name)[1] not in ("", unit):
            raise Refused(f"column {name}: found the unit {unit} in the row of units, expected {split_unit(name)[1]} as in its name: correct one of them")
        self.title = f"{name} [{unit}]" if unit and name and not split_unit(name)[1] else name or f"column {number}"
        self.number, self.blocks, self.sign, self.forms = number, [], ".", {}
        self.bare, self.unit = split_unit(self.title)

    def cells(self):
        return (cell for block in self.blocks for cell in block.split("\n"))

    def find_forms(self):
        """Sets forms: {form: [count, row, cell]}. More than FORMS_MAX are a text."""
        row = 0
        for block in self.blocks:
            forms = block.translate(TO_FORM).split("\n")
            for form, count in collections.Counter(forms).items():
                if form not in self.forms:
                    self.forms[form] = [0, row + forms.index(form), block.split("\n")[forms.index(form)]]
                self.forms[form][0] += count
            row += len(forms)
            self.forms = self.forms if len(self.forms) < FORMS_MAX else {"text": [1, 0, "text"]}

    def is_number(self):
        return any(map(decimal_signs, self.forms))

    def evidence(self):
        """{sign: form} of forms that are numbers with one decimal sign only; "0,500" has no groups."""
        found = {}
        for form in filter(decimal_signs, self.forms):
            signs, mark = decimal_signs(form), "," if "," in form else "."
            if len(signs) == 1 or EITHER.fullmatch(form) and any(re.search(rf"(?m)^[+-]?0[{mark}][0-9]{{3}}$", block) for block in self.blocks):
                found.setdefault(signs if len(signs) == 1 else mark, form)
        return found

    def choose_sign(self, stated, of_all, lines):
        """Sets the decimal sign. `of_all`: the signs for which any column has evidence."""
        evidence, numbers = self.evidence(), list(filter(decimal_signs, self.forms))
        either, whole = list(filter(EITHER.fullmatch, numbers)), [form for form in numbers if form.lstrip("+-").isdigit()]
        self.sign = stated or next(iter(evidence), ".")
        if len(evidence) > 1 and not stated:
            places = " and ".join(f"\"{self.forms[form][2]}\" in line {lines[self.forms[form][1]]}" for form in evidence.values())
            raise Refused(f"column {self.title}: found {places}, expected one decimal sign; --decimal . or --decimal , shows what does not fit")
        if not stated and not evidence and either:
            row, cell = self.forms[either[0]][1:]
            self.sign, other = (",", ".") if "," in cell else (".", ",")
            if of_all != {self.sign} or whole and all(len(form.lstrip("+-")) < 4 for form in whole):
                both = " or ".join(f"{plain_number(cell, sign)} (--decimal \"{self.title}:{sign}\")" for sign in (self.sign, other))
                raise Refused(f"line {lines[row]}: column {self.title}: two readings are possible: \"{cell}\" is {both}; --decimal {self.sign} states all columns")

    def check(self, lenient, lines):
        """Refuses a cell that is neither a number nor missing. Returns the number of missing cells."""
        bad = [form for form in self.forms if self.sign not in decimal_signs(form) and form.lower() not in HOLES]
        if bad and not lenient:
            row, cell = min(self.forms[form][1:] for form in bad)
            raise Refused(f"line {lines[row]}: column {self.title}: found \"{cell[:40]}\", expected a number with the decimal sign \"{self.sign}\"; "
                          "--missing TEXT or --lenient counts such cells as missing, --columns leaves the column out")
        return sum(count for form, (count, *_) in self.forms.items() if form in bad or form.lower() in HOLES)

    def plain(self, block):
        """The cells of a block in plain form, "" if missing."""
        block, sign = (block.replace(",", "."), ".") if self.sign == "," and "." not in block else (block, self.sign)
        cells, forms = block.split("\n"), block.translate(TO_FORM).split("\n")
        known = {form: "" if form.lower() in HOLES or sign not in decimal_signs(form) else "same" if sign == "." and AS_IT_IS.fullmatch(form) else "number"
                 for form in set(forms)}
        if set(known.values()) == {"same"}:
            return cells
        return [cell if known[form] == "same" else known[form] and plain_number(cell, sign) for cell, form in zip(cells, forms)]


class Table:
    """Columns; `lines`: the line of the file of each row; `sign`: the decimal sign of this kind of file; `signs`: the same if no cell decides."""

    def __init__(self, text, names, units=(), sign=None, signs=frozenset()):
        self.text, self.sign, self.signs, self.lines, self.notes = text, sign, signs, array.array("q"), []
        self.columns = [Column(i, name, unit) for i, (name, unit) in enumerate(itertools.zip_longest(names, units, fillvalue=""), 1)]

    def locate(self, text):
        """The column with this name (with its unit or without) or number, or None."""
        for names in zip(*((column.title, column.bare, str(column.number)) for column in self.columns)):
            if names.count(text) > 1:
                numbers = " or ".join(str(number) for number, name in enumerate(names, 1) if name == text)
                raise Refused(f"found column \"{text}\" twice, expected one; give its number, {numbers}")
            if text in names:
                return self.columns[names.index(text)]
        return None

    def names(self):
        return ", ".join(f"{column.number} {column.title}" for column in self.columns[:30])


# ---- Units ----

UNITS = set("deg/h °/h deg/hr °/hr deg/s °/s dps rad/s arcsec/s degc deg_c °c ℃ ﾟc c k kelvin degf °f f v volt volts mv deg rad a ma pa hpa bar g m m/s² m/s^2 hz "
            "° %".split()) | {"deg c", "° c", "rad / s"}
NO_UNITS = re.compile(r"ts|rn|no\.|-|1|time|unit|ao?\d{3,}")  # in rows of units, too
TIME_UNITS = {word: unit for unit, words in {
    "s": "s sec secs second seconds sekunden", "ms": "ms msec millisecond milliseconds", "us": "us µs μs usec microseconds", "ns": "ns nsec nanoseconds",
    "min": "min mins minute minutes minuten", "h": "h hr hrs hour hours std stunden", "d": "d day days tage"}.items() for word in words.split()}
SECONDS = {"s": "1", "ms": "1e-3", "us": "1e-6", "ns": "1e-9", "min": "60", "h": "3600", "d": "86400"}
TIME_NAME = re.compile(r"(?i)time|zeit|datum|\bdate|stamp|uhr|时间|時間|日付|日時|время|fecha|hora\b|^(?-i:t)$|^x_value$")


def is_units(cells):
    """True for a row of which most cells are units."""
    filled = [cell.lower() for cell in cells if cell]
    return 2 * sum(cell[0] in "[(" or cell in UNITS or cell in TIME_UNITS or bool(NO_UNITS.fullmatch(cell)) for cell in filled) > len(filled)


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


# ---- Times ----

CLOCK = (r"(?P<H>[0-9]{1,4}):(?P<M>[0-5][0-9])(?::(?P<S>[0-5][0-9])(?:[.,](?P<f>[0-9]{1,9})[0-9]*|:(?P<ms>[0-9]{3}))?)?"
         r"(?:\s*(?P<half>[AaPp])\.?[Mm]\.?)?(?:\s*(?P<zone>Z|UTC|GMT|[+-][0-9]{2}:?[0-9]{2}))?")
YEAR, SHORT, MONTH, DAY, NAME = "(?P<y>[0-9]{4})", "(?P<y>[0-9]{2})", "(?P<m>[0-9]{1,2})", "(?P<d>[0-9]{1,2})", r"(?P<m>[^\W\d_]{3,9})"
DATES = [("ymd", rf"{YEAR}([-/.]){MONTH}\2{DAY}"), ("ymd", r"(?P<y>[0-9]{4})(?P<m>[0-9]{2})(?P<d>[0-9]{2})(?=[T ])"),
         ("dmy", rf"{DAY}(\.){MONTH}\.{YEAR}"), ("dmy", rf"{DAY}([-/ ]){MONTH}\2{YEAR}"), ("mdy", rf"{MONTH}([-/ ]){DAY}\2{YEAR}"),
         ("dmy", rf"{DAY}([-/.]){MONTH}\2{SHORT}"), ("mdy", rf"{MONTH}([-/]){DAY}\2{SHORT}"), ("ymd", rf"{SHORT}([-/.]){MONTH}\2{DAY}"),
         ("dmy", rf"{DAY}([-/. ]|\. ){NAME}\.?\2(?P<y>[0-9]{{4}}|[0-9]{{2}})"), ("mdy", rf"{NAME}\.? {DAY},? {YEAR}"), ("clock", None)]
FORMATS = [re.compile(rf"\[?{date}(?:(?:[T_]|,? +|,){CLOCK})?\]?" if date else rf"\[?{CLOCK}\]?") for _, date in DATES]
ORDERS = {"ymd": "year-month-day", "dmy": "day.month.year", "mdy": "month/day/year", "clock": "time of day"}
MONTHS = {month: i // 3 + 1 for i, month in enumerate("jan jan jan feb feb feb mar mrz mär apr apr apr may mai mai jun jun jun jul jul jul aug aug aug sep sep sep "
                                                      "oct okt okt nov nov nov dec dez dez".split())}
# Numbers that can only be times since an origin: (name, seconds of one, s from 1970 to the origin)
EPOCHS = [("unix", "1", 0), ("unix_ms", "1e-3", 0), ("unix_us", "1e-6", 0), ("unix_ns", "1e-9", 0), ("labview", "1", -2082844800),
          ("excel", "86400", -25569 * 86400), ("datenum", "86400", -719529 * 86400), ("filetime", "1e-7", -11644473600), ("ticks", "1e-7", -62135596800)]
EARLIEST_S, LATEST_S = 946684800, 2208988800  # 2000 to 2040


@functools.lru_cache(maxsize=1 << 12)
def moment(key, cell):
    """(ns since 1970 or midnight, whether the cell has a zone) by FORMATS[key] or a form of strptime; None if the cell is no such time."""
    epoch = datetime.datetime(1970, 1, 1, tzinfo=datetime.timezone.utc)
    with contextlib.suppress(ValueError):
        if isinstance(key, str):
            stamp = datetime.datetime.strptime(cell, key)
            return (stamp.replace(tzinfo=stamp.tzinfo or epoch.tzinfo) - epoch) // datetime.timedelta(microseconds=1) * 1000, stamp.tzinfo is not None
        found = FORMATS[key].fullmatch(cell)
        part = found.groupdict() if found else {"H": "99"}
        hour, is_clock, half = int(part["H"] or 0), DATES[key][0] == "clock", (part.get("half") or "").lower()
        if not found or half and not 1 <= hour <= 12 or hour > 23 and not is_clock:
            return None
        zone = part["zone"] or "Z"
        offset_min = 0 if zone[0] in "ZUG" else int(zone[0] + "1") * (int(zone[1:3]) * 60 + int(zone[-2:]))
        seconds = (hour % 12 + 12 * (half == "p") if half else hour) * 3600 + (int(part["M"] or 0) - offset_min) * 60 + int(part["S"] or 0)
        if not is_clock:
            month = int(part["m"]) if part["m"].isdigit() else MONTHS.get(part["m"][:3].lower(), 0)
            year = int(part["y"]) + 2000 * (len(part["y"]) == 2)
            seconds += (datetime.date(year, month, int(part["d"])).toordinal() - 719163) * 86400
        return seconds * NS + int((part["f"] or "0").ljust(9, "0")) + int(part["ms"] or 0) * 1_000_000, part["zone"] is not None


@functools.lru_cache(maxsize=64)
def iso_second(seconds):
    return (datetime.datetime(1970, 1, 1) + datetime.timedelta(seconds=seconds)).isoformat()


class Times:
    """The time of each row: ns since 1970 if `absolute`, else since any origin."""

    def __init__(self, name, ns, text, absolute=False, zone=""):
        self.name, self.ns, self.absolute, self.zone = name, ns, absolute, zone
        self.text = text + ("" if zone or not absolute else ", no zone: taken for UTC")

    def show(self, ns):
        seconds, fraction = divmod(ns if self.absolute else abs(ns), NS)
        text = iso_second(seconds) if self.absolute else f"{'-' * (ns < 0)}{seconds}"
        return text + (f".{fraction:09d}".rstrip("0") if fraction else "") + self.zone

    def check(self, lines):
        """Refuses times that go back. Returns the step (span by count between gaps), gaps and repeated stamps as text."""
        some = sorted(b - a for a, b in zip(self.ns[:10001], self.ns[1:10001])) or [0]
        usual = some[len(some) // 2] or (self.ns[-1] - self.ns[0]) // max(1, len(self.ns) - 1)
        gaps = gap_ns = repeated = 0
        for row, (a, b) in enumerate(zip(self.ns, itertools.islice(self.ns, 1, None)), 1):
            if b < a:
                raise Refused(f"line {lines[row]}: column {self.name}: the time goes back from {self.show(a)} to {self.show(b)}, expected increasing times; "
                              "if a new recording begins here, divide the file at this line")
            repeated += a == b
            if b - a > 1.5 * usual + 1_000_000:
                gaps, gap_ns = gaps + 1, gap_ns + b - a
        step_s = (self.ns[-1] - self.ns[0] - gap_ns) / max(1, len(self.ns) - 1 - gaps) / NS
        return f"every {step_s:.9g} s; {gaps} gaps" + f" of {gap_ns / NS:.6g} s in all" * (gaps > 0) + f"; {repeated} repeated stamps" * (repeated > 0)


def text_times(name, cells, how, lines):
    """The Times of texts. `cells`: a function that returns an iterator of them."""
    first, readings, zones, worst = next(cells()), {}, set(), (-1, "")
    for key in [how] if "%" in how else [n for n, (order, _) in enumerate(DATES) if how in ("", order) and moment(n, first)]:
        times = array.array("q")
        for cell in cells():
            head, point, tail = cell.replace(",", ".").rpartition(".")
            if point and head[-3:-2] == ":" and len(tail) < 10 and tail.isdecimal() and tail.isascii() and moment(key, head):
                time = moment(key, head)[0] + int(tail.ljust(9, "0")), moment(key, head)[1]
            else:
                time = moment(key, cell)
            if time is None:
                worst = max(worst, (len(times), cell))
                break
            times.append(time[0])
            zones.add(time[1])
        else:
            readings[key] = times
    if not readings:
        row, cell = max(worst, (0, first))
        raise Refused(f"line {lines[row]}: column {name}: found \"{cell[:40]}\", expected a time; state its form, as --time \"{name}:%d.%m.%Y %H:%M:%S\"")
    key, ns = next(iter(readings.items()))
    order = DATES[key][0] if isinstance(key, int) else how
    for other, times in readings.items():
        if times != ns:
            row = next(row for row, (a, b) in enumerate(zip(ns, times)) if a != b)
            both = " or ".join(f"{iso_second(time[row] // NS)[:10]} (--time \"{name}:{DATES[k][0]}\")" for k, time in ((key, ns), (other, times)))
            raise Refused(f"line {lines[row]}: column {name}: two readings are possible: \"{next(itertools.islice(cells(), row, None))}\" is {both}")
    if len(zones) > 1:
        raise Refused(f"column {name}: found times with a zone and without, expected the same in all rows")
    if order == "clock" and first.count(":") == 1 and how != "clock":
        both = f"hours and minutes (--time \"{name}:clock\") or minutes and seconds (--time \"{name}:%M:%S\")"
        raise Refused(f"column {name}: two readings are possible: \"{first}\" is {both}")
    if order == "clock" and max(ns) < 86400 * NS:
        day, last = 0, 0
        for row, time in enumerate(ns):
            day, last = day + 86400 * NS * (time < last - 43200 * NS), time  # midnight
            ns[row] = time + day
    return Times(name, ns, ORDERS.get(order, order), "%y" in order.lower() if "%" in order else order != "clock", "Z" * (True in zones and order != "clock"))


def number_times(column, how, lines):
    """The Times of a column of numbers, by their unit or a known origin."""
    how = how or time_unit(column)
    multiple = re.fullmatch(r"([0-9.eE+-]+)\s*\*?\s*(\w+)", how)
    factor, unit = (multiple[1], TIME_UNITS.get(multiple[2])) if multiple else ("1", TIME_UNITS.get(how))
    first = [Decimal(cell) for cell in column.plain(column.blocks[0])[:SAMPLE_ROWS] if cell]
    step = sorted(b - a for a, b in zip(first, first[1:]))[len(first) // 2 - 1] if len(first) > 1 else Decimal(0)
    found = [(name + ", taken for UTC", size, origin) for name, size, origin in EPOCHS if how == name or first and not how and
             EARLIEST_S < first[0] * Decimal(size) + origin < LATEST_S and (size != "86400" or step < Decimal("2e-4"))]
    found = [(f"a number of {factor} {unit}" if multiple else f"a number of {unit}", SECONDS[unit], None)] if unit else found
    if len(found) != 1:
        raise Refused(f"column {column.title}: two readings are possible: {'its unit is not known, ' * bool(how)}steps of {step:.4g} may be s, ms or another unit; "
                      f"--time \"{column.title}:UNIT\", one of {' '.join(SECONDS)}, as \"1000 s\", {' '.join(e[0] for e in EPOCHS)}, or %H%M%S")
    (text, size, origin), ns = found[0], array.array("q")
    size = Decimal(size) * Decimal(factor) * NS
    for cell in itertools.chain.from_iterable(map(column.plain, column.blocks)):
        time = int((Decimal(cell or 0) * size).to_integral_value()) + (origin or 0) * NS
        if not cell or abs(time) >= 1 << 63:
            raise Refused(f"line {lines[len(ns)]}: column {column.title}: found {'a time beyond 292 years' if cell else 'no time'}, expected one in each row")
        ns.append(time)
    return Times(column.title, ns, text, origin is not None, "Z" * (origin is not None))


def fraction_digits(column):
    """3 or 6 for a column that may be the ms or us of the times before it; else 0."""
    return {"ms": 3, "msec": 3, "us": 6}.get(column.bare.lower(), 3 if set(column.forms) == {"000"} else 0)


def find_time(table, options):
    """(Times, its columns) of --interval, --time or the one column that has times."""
    columns, first = table.columns, {column: next(column.cells()) for column in table.columns}
    if options.interval:
        return Times("time", array.array("q", (int(i * options.interval * NS) for i in range(len(table.lines)))), "rows at the stated interval"), []
    if options.time:
        for at in [len(options.time)] + [i for i, c in enumerate(options.time) if c == ":"]:
            name, how = options.time[:at], options.time[at + 1:]
            parts = [table.locate(part) for part in ([name] if table.locate(name) else name.split("+"))]
            if all(parts):
                return join_times(parts, how, table)
        raise Refused(f"--time: found \"{options.time}\", expected COLUMN[+COLUMN][:FORM] with one of {table.names()}")
    dates, clocks = ([c for c in columns if any(moment(key, first[c]) for key in keys)] for keys in (range(len(DATES) - 1), [len(DATES) - 1]))
    named = [c for c in columns if c.is_number() and c.bare.lower() not in ("ms", "msec", "us") and (time_unit(c) or TIME_NAME.search(c.bare.split(".")[-1]))]
    found = dates or clocks or named
    found = [c for c in found if c.bare.strip("_").lower() in ("time", "timestamp")] or found if len(found) > 1 else found
    if len(found) != 1:
        raise Refused(f"found {'several columns' if found else 'no column'} of times in {table.names()}; expected one; --time COLUMN:UNIT (as s), or --interval SECONDS")
    after = columns[found[0].number:found[0].number + 2] + [None, None]
    parts = found + [after[0]] if after[0] in clocks and found[0] in dates and ":" not in first[found[0]] else found
    after_it, name = after[len(parts) - 1], "+".join(column.title for column in parts)
    if after_it and fraction_digits(after_it) and parts[0] not in named and "." not in first[parts[-1]]:
        both = f"the fraction of the seconds before it (--time \"{name}+{after_it.title}\") or not (--time \"{name}\")"
        raise Refused(f"column {after_it.title}: two readings are possible: {both}")
    return join_times(parts, "", table)


def join_times(parts, how, table):
    """The Times of one column, or of a date, a time of day and a fraction of a second together."""
    def cells():
        for date, *rest in zip(*(column.cells() for column in parts)):
            for cell, column in zip(rest, parts[1:]):
                date += f".{cell:0>{fraction_digits(column)}}" if fraction_digits(column) else " " + cell
            yield date.replace("[", "").replace("]", "")

    if len(parts) == 1 and parts[0].is_number() and "%" not in how:
        return number_times(parts[0], how, table.lines), parts
    return text_times("+".join(column.title for column in parts), cells, how, table.lines), parts


# ---- Rows to a table: names, units, first row ----

def kind(cell):
    """"": missing; "v": a number or time; "s": numbers with another separator; "x": another text."""
    form = tidy([cell]).translate(TO_FORM)
    is_value = decimal_signs(form) or any(expression.fullmatch(cell.strip()) for expression in FORMATS)
    is_split = re.fullmatch(r"[-+0.,;|:/eE\t ]*0[-+0.,;|:/eE\t ]*", form) or re.search(r"[,;|\t] *[+-]?0[0.]*([,;|\t]|$)", form)
    return "" if form.lower() in HOLES else "v" if is_value else "s" if is_split else "x"


def find_layout(rows, options, comments=()):
    """Width, names, units and first line of a table by its first rows, [(line, cells)]. `comments`: rows that may have the names."""
    rows = [(line, [cell.strip() for cell in cells], [kind(cell) for cell in cells]) for line, cells in rows if any(map(str.strip, cells))]
    names, header = next((cells for line, cells, _ in rows if line == options.header_row), []), options.header_row or 0
    rows = [row for row in rows if row[0] > header]
    widths = collections.Counter(len(kinds) for line, _, kinds in rows if "v" in kinds and line >= (options.first_row or 0))
    if not widths:
        raise Refused("found no row of numbers" + (" below a line of names" if rows else ": the file is empty"))
    width = widths.most_common(1)[0][0]
    seen = [collections.Counter(column) for column in zip(*[kinds for _, _, kinds in rows if len(kinds) == width][-max(1, widths[width] // 2):])]
    texts = {c for c, count in enumerate(seen) if count["x"] + count["s"] > count["v"]}
    used = [c for c, count in enumerate(seen) if count["x"] + count["s"] + count["v"]]
    first = next((line for line, _, kinds in rows if len(kinds) == width and "v" in kinds and line >= (options.first_row or 0)
                  and (options.first_row or not any(k in ("x", "s") and c not in texts for c, k in enumerate(kinds)))), None)
    if first is None or not used or any(count["s"] > count["v"] + count["x"] for count in seen):
        raise Refused("found no rows of numbers that are alike; state --separator, --header-row or --first-row, or --hex for a hex dump")
    above = [row for row in rows if row[0] < first]
    full = [(line, cells) for line, cells, kinds in above if len(cells) > used[-1] and all(cells[c] for c in used) and "v" not in kinds]
    if options.header_row is None:
        full = full[:1] + [row for row in full[1:] if not is_units(row[1])]
        if len(full) > 1:
            both = " or ".join(f"{', '.join(cells[:4])} (--header-row {line})" for line, cells in full[:2])
            raise Refused(f"found two lines of names, expected one: {both}")
        # Names in a comment: numpy ("# t rate") and ROS ("%time,rate").
        marked = [names for cells in comments for names in ([cells[0].lstrip("#%/ ")] + cells[1:], cells[1:])
                  if len(names) == width and all(names) and "v" not in map(kind, names)]
        header, names = full[0] if full else (0, marked[0] if marked else [])
    between = [row for row in above if row[0] > header]
    for line, cells, kinds in between if not options.first_row else ():
        if any(k == "v" and c not in texts for c, k in enumerate(kinds)):
            c = next((c for c, k in enumerate(kinds) if k in ("x", "s") and c not in texts and len(kinds) == width), None)
            found = f"{len(kinds)} fields, expected {width}" if c is None else f"\"{cells[c][:40]}\" in column {names[c] if c < len(names) else c + 1}, expected a number"
            raise Refused(f"line {line}: found {found}; if the rows begin below: --first-row LINE; if this line has the names: --header-row LINE")
    titles = [(line, cells) for line, cells, kinds in above if "v" not in kinds and len(cells) > 1]
    if not names and options.header_row is None and titles:
        raise Refused(f"line {first}: found {width} fields, expected {len(titles[-1][1])} as in the names of line {titles[-1][0]}; --header-row LINE, 0 without names")
    units = next((["" if NO_UNITS.fullmatch(cell.lower()) else cell.strip("[]() ") for cell in cells] for _, cells, _ in between if names and is_units(cells)), [])
    return argparse.Namespace(width=width, names=(names + [""] * width)[:width], units=units[:width], header=header, first=first)


def fill(table, rows, layout, options):
    """Adds all rows below the names to the table."""
    rows, missing = (row for row in rows if row[0] >= layout.first), set(options.missing)
    names = layout.names if "v" not in map(kind, layout.names) else []
    while block := list(itertools.islice(rows, BLOCK_ROWS)):
        block = [(line, cells) for line, cells in block if any(cells) and cells != names]  # the names again
        for line, cells in block:
            if len(cells) != layout.width:
                raise Refused(f"line {line}: found {len(cells)} fields, expected {layout.width}")
        table.lines.extend(line for line, _ in block)
        for column, cells in zip(table.columns, zip(*(cells for _, cells in block))):
            column.blocks.append(tidy("" if cell.strip() in missing else cell for cell in cells) if missing else tidy(cells))
    return table


# ---- Text ----

SEPARATORS = {"tab": "\t", "semicolon": ";", "bar": "|", "comma": ",", "blank": " ", "none": ""}


def find_encoding(path):
    with open(path, "rb") as file:
        if file.read(2) in (codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE):
            return "utf-16"
    with contextlib.suppress(UnicodeDecodeError), open(path, encoding="utf-8-sig") as file:
        collections.deque(iter(lambda: file.read(1 << 20), ""), maxlen=0)
        return "utf-8-sig"
    return "cp1252"


def text_lines(path, encoding, notes, comments):
    """The lines that have a line end; a comment becomes an empty line and is added to `comments`."""
    number = 0
    try:
        with open(path, encoding=encoding, errors="replace" if encoding == "cp1252" else "strict", newline="") as file:
            for number, line in enumerate(file, 1):
                if "\0" in line:
                    raise Refused(f"line {number}: found a NUL byte, expected text; state --encoding, as utf-16-le or utf-32")
                if line[-1] not in "\r\n":
                    notes.append(f"line {number} has no line end and may be cut: not used; if it is complete, add a line end")
                    return
                if re.match(r"\s*(#(?!N/A|NUM!|VALUE!|DIV/0!|REF!|WERT!)|%|//)", line):
                    comments += [line] if len(comments) < 100 else []
                    line = "\n"
                yield "\n" if number == 1 and re.fullmatch(r"sep=.[\r\n]+", line) else line
    except (UnicodeError, LookupError) as error:
        raise Refused(f"line {number + 1}: is not text in {encoding} ({error.args[-1]}); state --encoding, as cp1252 or iso-8859-2") from None


def split(lines, separator, begin=0, first=1 << 62, comments_at=0):
    """(line, cells) below the line `begin`; from the line `first` on a cell is in one line. `comments_at`: the end of LabVIEW's header."""
    width = None
    if separator in (" ", ""):
        yield from ((number, line.split() if separator else [line.strip()]) for number, line in enumerate(lines, 1) if number > begin and line.strip())
        return
    reader, before = csv.reader(lines, delimiter=separator, strict=True, skipinitialspace=separator != "\t"), 0
    try:
        for cells in reader:
            if reader.line_num > before + (1 if before + 1 >= first else 20):
                raise csv.Error("a cell over several lines")
            if cells and before >= comments_at > 0 and width is None:
                width = len(cells) - (cells[-1] == "Comment")
            if cells and before >= begin:
                yield before + 1, cells[:width] if len(cells) - 1 == width and kind(cells[-1]) != "v" else cells
            before = reader.line_num
    except csv.Error as error:
        raise Refused(f"line {before + 1}: found a quote that is not closed ({error})") from None


def read_text(path, options):
    """The Table of a text with any separator."""
    notes, comments, encoding = [], [], options.encoding or find_encoding(path)
    sample = list(itertools.islice(text_lines(path, encoding, [], comments), SAMPLE_ROWS))
    end = max((number for number, line in enumerate(sample, 1) if line.startswith("***End_of_Header***")), default=0)  # LabVIEW
    with open(path, encoding=encoding, errors="replace") as file:
        stated = options.separator or (re.match("sep=(.)$", file.readline(100)) or [0, None])[1]
    stated = SEPARATORS.get(stated, stated)
    if stated is not None and len(stated) > 1:
        raise Refused(f"--separator: found \"{stated}\", expected {', '.join(SEPARATORS)} or one character")
    good, bad = {}, []
    for separator in SEPARATORS.values() if stated is None else [stated]:
        rows = []
        try:
            rows += split(sample, separator, end, comments_at=end)
            layout = find_layout(rows, options, [cells for line in reversed(comments) for _, cells in split([line.strip()], separator)])
            if layout.width > 1 or not separator or stated is not None:
                good[separator] = layout
        except Refused as error:
            bad.append((sum(kind(cell) == "v" for _, cells in rows[:100] for cell in cells), "quote" in str(error), -len(bad), error))
    sure = [separator for separator in good if separator in ("\t", ";", "|")][:1] or list(good)  # these are in no number
    if not sure:
        raise max(bad)[-1] if bad else Refused("found no rows of numbers; state --separator")
    separator, layout = sure[0], good[sure[0]]
    if len(sure) > 1:
        both = " or ".join(f"{good[mark].width} columns (--separator {name})" for name, mark in SEPARATORS.items() if mark in sure)
        raise Refused(f"line {layout.first}: two readings are possible: \"{sample[layout.first - 1].strip()[:40]}\" has {both}")
    labels = [line.rstrip("\r\n").split(separator) for line in sample[:end] if line.startswith("Y_Unit_Label")] or [[]]
    name = next((name for name, mark in SEPARATORS.items() if mark == separator), separator)
    text = f"{encoding}, separator {name}, " + (f"names in line {layout.header}" if layout.header else "names in a comment" if any(layout.names) else "no names")
    table = Table(text, layout.names, layout.units or ([""] + labels[-1][1:])[:layout.width], signs={"."} if separator == "," else set())
    fill(table, split(text_lines(path, encoding, notes, []), separator, layout.first - 1, layout.first, end), layout, options)
    table.notes += notes + ["not UTF-8: names are read as Windows-1252; --encoding states another one"] * (encoding == "cp1252")
    return table


# ---- Excel and MATLAB ----

def needs(module, package):
    try:
        return __import__(module)
    except ImportError:
        raise Refused(f"needs {package}: apt install {package}") from None


def check_inflated(path, size):
    """Refuses a file that inflates to more than files of measurements do."""
    most = max(INFLATED_FREE, INFLATED * os.path.getsize(path))
    if size > most:
        raise Refused(f"inflates to {size >> 20} MiB, expected at most {most >> 20} MiB of a file of {os.path.getsize(path)} bytes")


def read_workbook(path, options):
    """The Table of a sheet of an Excel file."""
    def text(value):
        if isinstance(value, (datetime.datetime, datetime.time)):
            return value.isoformat()
        value = value.total_seconds() if isinstance(value, datetime.timedelta) else value
        cell = "" if value is None else value if isinstance(value, str) else repr(value)
        return cell + "0" if isinstance(value, float) and EITHER.fullmatch(cell.translate(TO_FORM)) else cell  # a number has no groups

    def rows(sheet):
        return ((line, [text(value) for value in row] + [""] * ((sheet.max_column or 0) - len(row))) for line, row in enumerate(sheet.iter_rows(values_only=True), 1))

    openpyxl = needs("openpyxl", "python3-openpyxl")
    with zipfile.ZipFile(path) as archive:
        check_inflated(path, sum(entry.file_size for entry in archive.infolist()))
        if archive.testzip():
            raise ValueError("a checksum does not hold")
    sheets = {sheet.title: sheet for sheet in openpyxl.load_workbook(path, read_only=True, data_only=True).worksheets}
    filled = [name for name, sheet in sheets.items() if len(list(itertools.islice((row for _, row in rows(sheet) if any(row)), 2))) == 2]
    wanted = options.sheet or (filled[0] if len(filled) == 1 else None)
    if wanted not in sheets:
        raise Refused(f"found {'the sheets ' + ', '.join(filled) if filled else 'no sheet with rows'}, expected one; --sheet NAME")
    layout = find_layout(list(itertools.islice(rows(sheets[wanted]), SAMPLE_ROWS)), options)
    return fill(Table(f"Excel, sheet {wanted}, names in line {layout.header}", layout.names, layout.units), rows(sheets[wanted]), layout, options)


def read_mat(path, options):
    """The Table of a MATLAB file: vectors, and columns of matrices of either orientation, of the length of the time."""
    notes, vectors = [], {}
    with open(path, "rb") as file:
        is_hdf5 = b"\x89HDF\r\n\x1a\n" in file.read(520)
    for name, values in hdf5_variables(path, notes) if is_hdf5 else list(level5_variables(path, notes)):
        rows, columns = values.shape
        notes.append(f"{name}: {rows} x {columns}" + ", not used: as many rows as columns" * (rows == columns > 1))
        values = values if rows > columns else values.T
        vectors.update({f"{name}({c + 1})" if values.shape[1] > 1 else name: values[:, c] for c in range(min(values.shape[1], 1000)) if rows != columns})
    stated = re.split("[:+,]", options.time or ",".join(options.columns))[0]
    lengths = {len(vectors[stated])} if stated in vectors else {len(values) for values in vectors.values()}
    if len(lengths) != 1:
        raise Refused(f"found {'variables of several lengths' if vectors else 'no vector of numbers'}, expected one; --time NAME:UNIT states the length; {'; '.join(notes)}")
    length = lengths.pop()
    vectors = {name: values for name, values in vectors.items() if len(values) == length}
    table = Table("MATLAB file", list(vectors), sign=".")
    table.lines, table.notes = range(1, length + 1), notes
    for column, values in zip(table.columns, vectors.values()):
        column.blocks = ["\n".join(map(repr, values[i:i + BLOCK_ROWS].tolist())) for i in range(0, length, BLOCK_ROWS)]
    return table


MAT_TYPES = {1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 9: "f8", 12: "i8", 13: "u8"}
# Class: (name, types of its numbers). MATLAB stores doubles as shorter integers if they are integers.
MAT_CLASSES = {6: ("double", (9, 1, 2, 3, 4, 5, 6)), 7: ("single", (7, 1, 2, 3, 4)),
               **{8 + i: (f"{'u' * (i % 2)}int{8 << i // 2}", (1, 2, 3, 4, 5, 6, 12, 13)) for i in range(8)}}


def level5_variables(path, notes):
    """(name, matrix) of the numeric arrays of level 5. Each element must be inside its parent and have the length that its contents need."""
    numpy = needs("numpy", "python3-numpy")
    with open(path, "rb") as file:
        whole = memoryview(file.read())
    order = {b"\0\1IM": "<", b"\1\0MI": ">"}.get(bytes(whole[124:128]))
    if not order:
        raise ValueError("it has no header of level 5")

    def number(data, at):
        return int.from_bytes(data[at:at + 4], "little" if order == "<" else "big")

    def elements(data, is_top=False):
        """(type, bytes) of the elements that fill `data`."""
        at = 0
        while at < len(data):
            type_, size, begin, end = number(data, at), number(data, at + 4), at + 8, at + 8
            if type_ >> 16:
                type_, size, begin = type_ & 0xFFFF, type_ >> 16, at + 4  # a small element
            else:
                end = begin + (size if is_top and type_ == 15 else (size + 7) // 8 * 8)
            if begin + size > min(len(data), end) or end > len(data) + 7:
                raise ValueError("it is cut: an element is longer than the file or its parent")
            yield type_, data[begin:begin + size]
            at = end

    def inflated(element):
        stream = zlib.decompressobj()
        head = stream.decompress(element, 8)
        size = number(head, 4) + 8
        check_inflated(path, size)
        data = memoryview(head + stream.decompress(stream.unconsumed_tail, size))
        if len(data) != size or not stream.eof:
            raise ValueError("a compressed variable has another length than it states")
        return data

    def matrices(data, prefix):
        """(name, matrix) of an array, or of the fields of a struct as "struct.field"."""
        parts = list(elements(data))
        if not parts:
            return  # an empty field
        if len(parts) < 3 or parts[0][0] != 6 or len(parts[0][1]) != 8:
            raise ValueError("an array has no flags")
        flags, label = number(parts[0][1], 0), prefix + bytes(parts[2][1]).decode("ascii", "replace")
        name, types = MAT_CLASSES.get(flags & 0xFF, ({2: "struct", 1: "cell", 4: "text", 5: "sparse"}.get(flags & 0xFF, "object of MATLAB"), ()))
        if parts[1][0] != 5 and "object" not in name:
            raise ValueError("an array has no dimensions")
        shape = numpy.frombuffer(parts[1][1], order + "i4").tolist() if parts[1][0] == 5 else []
        if name == "struct" and shape == [1, 1] and len(parts) > 4:
            width, names = number(parts[3][1], 0), bytes(parts[4][1])
            fields = [names[i:i + width].split(b"\0")[0].decode("ascii", "replace") for i in range(0, len(names), width)] if 0 < width < 65 else []
            if len(fields) != len(parts) - 5 or any(type_ != 14 for type_, _ in parts[5:]):
                raise ValueError("a struct has other fields than it states")
            for field, (_, value) in zip(fields, parts[5:]):
                yield from matrices(value, f"{label}.{field}")
        elif not types or flags & 0x800 or len(shape) != 2:
            notes.append(f"{label or 'a variable'}: {'complex ' * (flags >> 11 & 1)}{name}, not used" + "; in MATLAB: save its numbers, as s.time = ts.Time" * ("object" in name))
        elif len(parts) != 4 or parts[3][0] not in types:
            raise ValueError("an array has numbers of an unknown type")
        else:
            values = numpy.frombuffer(parts[3][1], order + MAT_TYPES[parts[3][0]])
            if min(shape) < 0 or len(values) != shape[0] * shape[1]:
                raise ValueError("an array has another number of values than it states")
            yield label, values.reshape(shape, order="F")

    for type_, element in elements(whole[128:], True):
        for inner, data in elements(inflated(element)) if type_ == 15 else [(type_, element)]:
            if inner != 14:
                raise ValueError(f"a variable has the unknown type {inner}")
            yield from matrices(data, "")


def hdf5_variables(path, notes):
    """[(name, matrix)] of the numeric datasets of version 7.3. Each chunk is read and inflated by itself: HDF5
    has no checksums, and fills in zeros for a chunk that it does not find."""
    h5py, numpy = needs("h5py", "python3-h5py"), needs("numpy", "python3-numpy")
    types = [getattr(h5py.h5t, f"STD_{sign}{bits}LE") for sign in "IU" for bits in (8, 16, 32, 64)] + [h5py.h5t.IEEE_F64LE, h5py.h5t.IEEE_F32LE]

    def walk(group, prefix):
        for name in group:
            item = group[name] if isinstance(group.get(name, getlink=True), h5py.HardLink) and not name.startswith("#") else None
            if isinstance(item, h5py.Group):
                yield from walk(item, prefix + name + ".")
            elif isinstance(item, h5py.Dataset):
                class_ = item.attrs.get("MATLAB_class", b"double").decode()
                if class_ in (name for name, _ in MAT_CLASSES.values()) and len(item.shape) == 2 and item.dtype.kind in "iuf" and "MATLAB_empty" not in item.attrs:
                    yield prefix + name, values(item).T
                else:
                    notes.append(f"{prefix}{name}: {class_}, not used")

    def values(item):
        chunk = item.chunks or item.shape
        size, result = item.dtype.itemsize * math.prod(chunk), numpy.empty(item.shape, item.dtype)
        check_inflated(path, max(item.nbytes, size))
        if not any(item.id.get_type().equal(type_) for type_ in types) or (item.chunks and item.compression != "gzip") or item.shuffle or item.fletcher32:
            raise ValueError(f"{item.name} has numbers of an unknown type")
        if not item.chunks:
            if item.id.get_storage_size() != item.nbytes:
                raise ValueError(f"{item.name} is incomplete")
            return item[()]
        for place in itertools.product(*(range(0, length, step) for length, step in zip(item.shape, chunk))):
            (left_out, packed), stream = item.id.read_direct_chunk(place), zlib.decompressobj()
            data = stream.decompress(packed, size + 1)
            if left_out or len(data) != size or not stream.eof:
                raise ValueError(f"{item.name} is incomplete")
            area = tuple(slice(begin, begin + step) for begin, step in zip(place, chunk))
            result[area] = numpy.frombuffer(data, item.dtype).reshape(chunk)[tuple(slice(0, n) for n in result[area].shape)]
        return result

    with h5py.File(path, "r") as file:
        return list(walk(file, ""))


OTHER_FILES = {b"\xd0\xcf\x11\xe0": "an old Excel file (.xls); in Excel: save it as .xlsx", b"TDSm": "a TDMS file of LabVIEW; export it as text, or with npTDMS",
    b"ULog\x01": "a ULog of PX4; export it by ulog2csv FILE", b"#ROSBAG": "a bag of ROS; export a topic by rostopic echo -b FILE -p /TOPIC > out.csv",
    b"SQLite format 3": "an SQLite file (a bag of ROS 2); export a topic by ros2 topic echo --csv /TOPIC > out.csv",
    b"\x89MCAP": "an MCAP file (a bag of ROS 2); export a topic by ros2 topic echo --csv /TOPIC > out.csv",
    b"\x1f\x8b": "compressed by gzip; gunzip FILE", b"\xfd7zXZ": "compressed by xz; unxz FILE", b"PAR1": "a Parquet file; export it as CSV",
    b"%PDF": "a PDF document; export the table as CSV", b"# Created by Octave": "a text file of Octave; in Octave: save -v7 FILE.mat NAMES",
    b"# prism ": "a log of prismd, which prismcal reads", b"\xd4\xc3\xb2\xa1": "a capture, which prismcal reads", b"\x4d\x3c\xb2\xa1": "a capture, which prismcal reads"}


def read_table(path, options):
    with open(path, "rb") as file:
        head = file.read(512)
    if not head.strip():
        raise Refused("found no row of numbers: the file is empty")
    for what in (what for mark, what in OTHER_FILES.items() if head.startswith(mark)):
        raise Refused(f"is {what}")
    is_mat = head.startswith((b"MATLAB 5.0", b"MATLAB 7.3", b"\x89HDF")) or path.lower().endswith(".mat")
    if not is_mat and not head.startswith(b"PK\x03\x04"):
        return read_text(path, options)
    try:
        return read_mat(path, options) if is_mat else read_workbook(path, options)
    except (Refused, MemoryError):
        raise
    except Exception as error:  # a reader's, of any type
        what = "MATLAB file (.mat)" if is_mat else "Excel file (.xlsx)"
        raise Refused(f"is damaged or no {what}: {' '.join(str(error).split())[:120] or type(error).__name__}") from None


# ---- Hex text ----

BYTES = re.compile(r"(0[xX])?((?:[0-9A-Fa-f]{2})+)[hH]?")
SENTENCE = re.compile(r"[$!#%][^$*]{2,}\*([0-9A-Fa-f]{8}|[0-9A-Fa-f]{4}|[0-9A-Fa-f]{2})$")
STAMP = re.compile(r"(?i)[\[(]?[0-9][0-9:./T+-]{3,}Z?[\])]?:?|-|\[?[rt]x\]?:?|<|>|<--|-->")  # words before the bytes
DIRECTIONS = {"<": "rx", "rx": "rx", "<--": "rx", ">": "tx", "tx": "tx", "-->": "tx"}


def sentence_of(line):
    """The bytes of the sentence at the end of a line, or None; a checksum of two digits must hold."""
    found = SENTENCE.search(line)
    data = found[0].encode("latin-1", "replace") if found else b""
    check = functools.reduce(lambda a, b: a ^ b, data[1:data.rfind(b"*")], 0)
    return data + b"\r\n" if found and (len(found[1]) > 2 or int(found[1], 16) == check) else None


def dump_of(line):
    """(offset or None, direction or None, bytes) of a line of a hex dump; the bytes are None for another line."""
    offset = re.match(r"([0-9A-Fa-f]{6,16})(:|  |$)", line)
    if offset:
        line = line[offset.end():].split("|")[0] if offset[2] != ":" else re.split(r"(?<=\S)  ", line[offset.end():], maxsplit=1)[0]
    words = [word for word in re.split(r"[ \t,;]+", line) if word]
    direction = next((DIRECTIONS[mark] for mark in (word.strip("[]:").lower() for word in words) if mark in DIRECTIONS), None)
    if direction and "length=" in line:
        return None, direction, b""  # socat -x
    digits = [BYTES.fullmatch(word)[2] for word in itertools.takewhile(BYTES.fullmatch, reversed(words))][::-1]
    before = words[:len(words) - len(digits)]
    is_run = len(digits) == 1 and len(digits[0]) >= 32  # bytes without blanks between them
    if before and (offset or not all(map(STAMP.fullmatch, before))) or not offset and not is_run and (not digits or any(len(pair) != 2 for pair in digits)):
        return None, direction, None
    return offset and int(offset[1], 16), direction, bytes.fromhex("".join(digits))


def convert_hex(path, options):
    """Writes the bytes that a hex dump or a log of sentences shows."""
    with open(path, encoding=options.encoding or find_encoding(path), errors="replace") as file:
        lines = [(number, line.rstrip()) for number, line in enumerate(file, 1) if line.strip()]
    is_sentences = 2 * sum(sentence_of(line) is not None for _, line in lines[:200]) > len(lines[:200])
    found, skipped, direction, last, is_dump, repeats, base = collections.defaultdict(bytearray), [], None, b"", is_sentences, False, None
    for number, line in lines:
        offset, stated, data = (None, None, sentence_of(line)) if is_sentences else dump_of(line)
        direction = stated or direction
        data = None if base is not None and offset is None and line != "*" else data  # a line that lost its offset
        if line == "*" and last:
            repeats = True
        elif data is None:
            if last and not options.lenient:
                expected = "a sentence with a good checksum" if is_sentences else "bytes in hex"
                raise Refused(f"line {number}: found \"{line[:40]}\", expected {expected}; --lenient leaves such lines out")
            skipped.append(number)
        else:
            if offset is not None:
                base = offset if base is None else base
                while repeats and last and len(found[direction]) < min(offset - base, 1 << 30):
                    found[direction] += last
                if offset - base != len(found[direction]):
                    raise Refused(f"line {number}: found the offset {offset:x}, expected {base + len(found[direction]):x}: lines are missing")
            found[direction] += data
            is_dump = is_dump or offset is not None or direction is not None or re.search("[a-f]", data.hex()) is not None
            last, repeats = data or last, False
    sizes = {key: len(data) for key, data in found.items() if data}
    if len(sizes) > 1 and not options.direction:
        raise Refused(f"found two directions, expected one: {' or '.join(f'{size} bytes (--direction {key})' for key, size in sizes.items())}")
    data = found[options.direction or next(iter(sizes), None)]
    if not data or not is_dump:
        raise Refused(f"found {'decimal numbers' if data else 'no bytes in hex'}, expected a dump with offsets or hex letters, or sentences ($...*HH)")
    with output(options.out, "wb") as file:
        file.write(data)
    say(options, [f"{path}: {len(data)} bytes, {'sentences' if is_sentences else 'hex dump'}, {len(lines) - len(skipped)} lines"]
        + [f"lines without bytes: {', '.join(map(str, skipped[:9]))}{' …' * (len(skipped) > 9)}"] * bool(skipped))


# ---- The program ----

def convert(path, options):
    """Reads a table, writes it, and prints how it was understood."""
    table = read_table(path, options)
    if not table.lines:
        raise Refused("found no row of numbers below the names")
    kept, stated = [], {}
    for part in [part.strip() for text in options.columns for part in ([text] if table.locate(text) else text.split(","))]:
        if not table.locate(part):
            raise Refused(f"--columns: found \"{part}\", expected names or numbers of {table.names()}")
        kept.append(table.locate(part))
    for text in options.decimal:
        name, _, sign = text.rpartition(":")
        if sign not in {".", ","} or name and not table.locate(name):
            raise Refused(f"--decimal: found \"{text}\", expected . or , or COLUMN: and one of them")
        stated.update({column: sign for column in ([table.locate(name)] if name else table.columns)})
    if any(column.title == "_field" and len(set(column.cells())) > 1 for column in table.columns):
        raise Refused("column _field: found several quantities below each other (InfluxDB), expected a column for each; in Flux: "
                      "|> pivot(rowKey: [\"_time\"], columnKey: [\"_field\"], valueColumn: \"_value\")")
    for column in table.columns:
        column.find_forms()
    numbers = [column for column in table.columns if column.is_number()]
    signs = {sign for column in numbers for sign in column.evidence()} or table.signs
    for column in numbers:
        column.choose_sign(stated.get(column, table.sign), signs, table.lines)
    times, parts = find_time(table, options)
    steps = times.check(table.lines)
    texts, kept = ([column for column in kept or table.columns if column not in parts and (column in numbers) == wanted] for wanted in (False, True))
    if not kept:
        raise Refused(f"found no column of numbers besides the time, expected one of {table.names()}")
    missing = [column.check(options.lenient, table.lines) for column in kept]
    titles = [column.title if [c.title for c in kept].count(column.title) == 1 else f"{column.title} (column {column.number})" for column in kept]
    with output(options.out, "w") as file:
        csv.writer(file, lineterminator="\n").writerow(["time" if times.absolute else "time_s"] + titles)
        row = 0
        for blocks in zip(*(column.blocks for column in kept)) if options.out else ():
            cells = [column.plain(block) for column, block in zip(kept, blocks)]
            file.write("\n".join(map(",".join, zip(map(times.show, times.ns[row:row + len(cells[0])]), *cells))) + "\n")
            row += len(cells[0])
    say(options, [f"{path}: {table.text}; {len(table.lines)} rows, lines {table.lines[0]} to {table.lines[-1]}",
                  f"time: {times.name}: {times.text}; {times.show(times.ns[0])} to {times.show(times.ns[-1])}; {steps}"]
        + [describe(title, column, holes, times) for title, column, holes in zip(titles, kept, missing)]
        + [f"not used: text in {', '.join(column.title for column in texts)}"] * bool(texts) + table.notes)


def describe(title, column, holes, times):
    """First and last value of a column, and the step of its values if some are missing."""
    values = [(row, cell) for row, cell in enumerate(itertools.chain.from_iterable(map(column.plain, column.blocks))) if cell] if holes else []
    step_s = (times.ns[values[-1][0]] - times.ns[values[0][0]]) / max(1, len(values) - 1) / NS if values else 0
    ends = (values[0][1], values[-1][1]) if values else (column.plain(column.blocks[0])[0], column.plain(column.blocks[-1])[-1])
    return f"{title}: {ends[0]} to {ends[1]}" + f"; {holes} missing, a value every {step_s:.6g} s" * (holes > 0) + "; decimal comma" * (column.sign == ",")


def say(options, lines):
    print("\n  ".join(lines), file=sys.stderr if options.out == "-" else sys.stdout)


@contextlib.contextmanager
def output(path, mode):
    """A file that replaces `path` if all is written; "-" is stdout; None: nothing is written."""
    part = f"{path}.{os.getppid()}.part" if path else os.devnull
    if path == "-":
        yield sys.stdout.buffer if mode == "wb" else sys.stdout
        return
    with open(part, mode, **({} if mode == "wb" else {"encoding": "utf-8", "newline": ""})) as file:
        yield file
    if path:
        os.replace(part, path)


def limited(work, path, options, memory, seconds):
    """Runs the work with limits. Returns its exit code; each error is one line."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    for limit, value in ((resource.RLIMIT_AS, memory), (resource.RLIMIT_CPU, seconds), (resource.RLIMIT_CORE, 0)):
        resource.setrlimit(limit, (value, value + 5 * (limit == resource.RLIMIT_CPU)))
    warnings.simplefilter("ignore")
    try:
        sys.stdout.reconfigure(encoding="utf-8" if options.out == "-" else None, errors="replace")
        work(path, options)
        sys.stdout.flush()
        return 0
    except Refused as error:
        message = f"{path}: {' '.join(str(error).split())}"
    except MemoryError:
        message = f"{path}: needs more than {memory >> 20} MiB, the limit for a file of {os.path.getsize(path)} bytes"
    except OSError as error:
        message = f"{re.sub('[.][0-9]+[.]part$', '', error.filename or options.out or path)}: {error.strerror or error}"
    except Exception as error:  # a fault of this program
        message = f"{path}: {type(error).__name__}: {error}; please report it with the file"
    print(f"prism-import: {' '.join(message.split())}", file=sys.stderr, flush=True)
    return 70 if "please report" in message else 1


def guarded(work, path, options):
    """Runs the work in a process of its own, so that a damaged file ends with one line whatever a library does."""
    seconds, end = 60 + os.path.getsize(path) // 20000, None
    child = os.fork()
    if child == 0:
        os._exit(limited(work, path, options, (2 << 30) + 12 * os.path.getsize(path), seconds))
    signal.signal(signal.SIGTERM, lambda *_: os.kill(child, signal.SIGTERM))
    while end is None:
        with contextlib.suppress(KeyboardInterrupt):
            end = os.waitpid(child, 0)[1]
    with contextlib.suppress(OSError):
        os.unlink(f"{options.out}.{os.getpid()}.part")
    number = 0 if os.WIFEXITED(end) else os.WTERMSIG(end)
    if number in (0, signal.SIGINT, signal.SIGTERM):
        return 128 + number if number else os.WEXITSTATUS(end)
    why = f"takes more than {seconds} s of processor time" if number == signal.SIGXCPU else f"is damaged: its reader ended with {signal.Signals(number).name}"
    print(f"prism-import: {path}: {why}", file=sys.stderr)
    return 1


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
EXAMPLES = """Examples:
  prism-import export.xlsx
  prism-import chamber.csv --time Time:s --out chamber-plain.csv
  prism-import terminal.log --hex --out line.bin"""


def main(arguments):
    parser = argparse.ArgumentParser(prog="prism-import", usage="prism-import FILE [--out TABLE.csv] [OPTIONS]", allow_abbrev=False, add_help=False, epilog=EXAMPLES,
                                     formatter_class=lambda prog: argparse.RawDescriptionHelpFormatter(prog, max_help_position=30, width=150),
                                     description="read a table of another program (CSV, Excel, MATLAB) and write a plain table for prismcal")
    parser.add_argument("file", metavar="FILE", help=argparse.SUPPRESS)
    group = parser.add_argument_group("Options")
    group.add_argument("-h", action="help", help=argparse.SUPPRESS)
    group.add_argument("--help", action="help", help="print this help message and exit")
    for line in OPTIONS.strip().split("\n"):
        name, value, text = re.fullmatch(r"(\S+)(?: (\S+))?  +(.*)", line).groups()
        more = {"LINE": {"type": int}, "SECONDS": {"type": float}, "RX|TX": {"choices": ("rx", "tx")}}.get(value, {})
        more = {"action": "append", "default": []} if "(repeat)" in text else more
        group.add_argument(name, help=text, **({"metavar": value, **more} if value else {"action": "store_true"}))
    parser.error = lambda message: parser.exit(64, f"prism-import: {message}; see prism-import --help\n")
    options = parser.parse_args(arguments)
    try:
        if not stat.S_ISREG(os.stat(options.file).st_mode):
            raise OSError(0, "is not a regular file, expected one")
        open(options.file, "rb").close()
        if options.out and os.path.exists(options.out) and os.path.samefile(options.file, options.out):
            raise OSError(0, "found the same file as --out, expected another one")
    except OSError as error:
        print(f"prism-import: {options.file}: {error.strerror}", file=sys.stderr)
        return 1
    return guarded(convert_hex if options.hex else convert, options.file, options)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
