#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
# Lists the lines that match a pattern of plain_english.txt, and fails if there are any. A line that has to
# keep its words ends with `plain-ok: reason`.
import os
import re
import sys

sys.dont_write_bytecode = True
import house_rules

EXCEPTIONS_MAX = 100
EXCEPTION = re.compile(r"plain-ok: \S")
# texts of the programs, recorded data, a client of an earlier version, generated files, the patterns themselves, and a description whose texts are part of the fingerprint in logs
SKIPPED = re.compile(r"^tests/outputs/.*\.expected$|^config/frames/astrix-ns\.json$|^tests/golden/|^tests/plain_english\.txt$|/recordings/|completions|^LICENSE$|\.(pcap|bin|png|svg|csv|gz|hex|pyc)$")
with open(os.path.join(house_rules.ROOT, "tests/plain_english.txt"), encoding="utf-8") as file:
    PATTERNS = [re.compile(line.rstrip("\n"), re.IGNORECASE) for line in file]


def matches(text):
    """Yields (line number, matched words, whether the line is an exception) for each line that matches."""
    for number, line in enumerate(text.split("\n"), 1):
        match = next(filter(None, (pattern.search(line) for pattern in PATTERNS)), None)
        if match:
            yield number, match.group().strip(), bool(EXCEPTION.search(line))


def main(paths):
    found = exceptions = 0
    for path, full in house_rules.files_of(house_rules.ROOT):
        if SKIPPED.search(path) or not path.startswith(tuple(paths or [""])):
            continue
        with open(full, encoding="utf-8", errors="replace") as file:
            for number, words, exception in matches(file.read()):
                exceptions += exception
                found += not exception
                if not exception:
                    print(f"{path}:{number}: {words}")
    print(f"plain English: {found} lines to rewrite, {exceptions} exceptions (at most {EXCEPTIONS_MAX})")
    return 1 if found > 0 or exceptions > EXCEPTIONS_MAX else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
