# SPDX-License-Identifier: MIT
# Compares the table "The path of a frame" in docs/architecture.md with the code: each call is in the file of its row,
# and a file of the table contains the function.
import os
import re

SYSTEM_CALLS = {"read", "recv", "recvfrom", "send"}
PAGE = "docs/architecture.md"
ROW = re.compile(r"^\|([^|]*)\|([^|]*)\|[^|]*\|$")
CALL = re.compile(r"`([^`]*?(\w+)\()`")


def rows_of(text):
    """Number, files or folders, and calls of each row."""
    inside = False
    for number, line in enumerate(text.splitlines(), 1):
        inside = line == "### The path of a frame" or (inside and not line.startswith("#"))
        row = ROW.match(line) if inside else None
        if row and "/" in row.group(1):
            yield number, [name.strip() for name in row.group(1).split(",")], CALL.findall(row.group(2))


class FramePath:
    def __init__(self, files):
        self.code = {path: text for path, text in files if path.endswith((".cpp", ".hpp"))}

    def text_of(self, names):
        """The code of files, with their headers, and of folders."""
        stems = {os.path.splitext(name)[0] for name in names}
        return "".join(text for path, text in self.code.items()
                       if os.path.splitext(path)[0] in stems or os.path.dirname(path) in names)

    def __call__(self, path, text):
        if path != PAGE:
            return
        rows = list(rows_of(text))
        everything = self.text_of([name for _, names, _ in rows for name in names])
        for number, names, calls in rows:
            code = self.text_of(names)
            if not code:
                yield number, f"lists {', '.join(names)}, which contains no code"
            for call, function in calls:
                if call not in code:
                    yield number, f"lists the call {call}…), which {', '.join(names)} does not contain"
                elif function not in SYSTEM_CALLS and not function.endswith("_") and not re.search(
                        rf"[\w>*&] (?:\w+::)?{function}\(", everything):
                    yield number, f"lists the call {call}…), but no file of the table contains the function"
