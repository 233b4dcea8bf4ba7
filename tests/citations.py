# SPDX-License-Identifier: MIT
# Checks that comments and documents cite what exists: files, headings of pages, names in the code, and values of constants.
# A rule of house_rules.py.
import os
import re

CODE = (".cpp", ".hpp", ".js", ".mjs")
SKIPPED = re.compile(r"^CHANGELOG\.md$|^LICENSE$|^tests/golden/")
# examples, paths of a web server, and files of other projects
NOT_FILES = {"a.cpp", "line.sh", "lib/charts.js", "docs/spec.md", "NAME.SECTION.scd"}
OTHER_LIBRARIES = ("sqlite3_", "pthread_", "sd_", "std", "boost", "steady_clock", "now")
NAME = r"[A-Za-z0-9_-][A-Za-z0-9_.-]*"
FILE = re.compile(rf"(?<![\w./~<$*{{}}:%@-])((?:\.\./)*(?:{NAME}/)*{NAME}\.(?:cpp|hpp|py|mjs|js|sh|md|scd|sql|cmake))(?![\w/*])")
SECTION = re.compile(r'([\w/.-]+\.md)\)?,\s+(?:/+\s*|#\s*)?"([^"\n]+)"')
IDENTIFIER = re.compile(r"(?<![\w.:/<-])(?:(\w+)::)?([a-z_]\w{2,})\(\)|\b(k[A-Z]\w+)\b|(?<=`)([A-Z][a-z]+(?:[A-Z][a-z0-9]+)+)(?=`)|(?<![\w/.\"`])([A-Z][a-z]+(?:[A-Z][a-z0-9]+)+)::")
FIGURE = re.compile(r"\b(k[A-Z]\w+)`?(?: = |: | is | \()(-?\d[\d.]*(?:e-?\d+)?)(?![\w.]*\d)")
NUMBER = r"-?[\d.']+(?:e-?\d+)?"
CONSTANT = re.compile(rf"\b(k[A-Z]\w+)\s*(?:=|\{{)\s*({NUMBER})(?=[,;}}\s])")


def comments_of(path, text):
    """The comments of code and scripts, or the complete text of a document. Blanks replace the rest."""
    if path.endswith((".md", ".scd")):
        return text
    kept = [c if c == "\n" else " " for c in text]
    if path.endswith(CODE):
        comment = r"//[^\n]*|/\*(?:.|\n)*?\*/"
    elif path.endswith((".py", ".sh", ".cmake", "CMakeLists.txt")) or text.startswith("#!"):
        comment = r"(?m)(?:^|(?<=\s))#(?!!)[^\n]*"
    else:
        return "".join(kept)
    for match in re.finditer(comment, text):
        kept[match.start() : match.end()] = match.group()
    return "".join(kept)


def without_marks(heading):
    return re.sub(r"[`*]|\[|\]\([^)]*\)", "", heading).strip().lower()


class Citations:
    """Reads the complete tree first: `files` are pairs of path and text."""

    def __init__(self, files):
        self.paths, self.words, self.constants, self.headings = set(), set(), {}, {}
        for path, text in files:
            self.paths.update((path, os.path.basename(path)))
            if path.endswith(".md"):
                self.headings[os.path.basename(path)] = {
                    without_marks(h) for pair in re.findall(r"(?m)^#+ (.*)$|^(?:- )?\*\*(.+?)\*\*", text) for h in pair}
                continue
            code = "".join(" " if kept not in " \n" else c for c, kept in zip(text, comments_of(path, text)))
            self.words.update(re.findall(r"[A-Za-z_]\w*", code))
            for name, value in CONSTANT.findall(code):
                self.constants.setdefault(name, set()).add(float(value.replace("'", "")) if value.strip(".") else None)

    def exists(self, path, cited):
        near = [os.path.normpath(os.path.join(base, cited)) for base in ("", os.path.dirname(path), "docs", "tests")]
        return cited in NOT_FILES or any(p in self.paths or p.startswith("..") for p in near)

    def missing(self, path, text):
        for match in FILE.finditer(text):
            if not self.exists(path, match.group(1)):
                yield match, f"cites {match.group(1)}, which does not exist"
        for match in SECTION.finditer(text):
            page = os.path.basename(match.group(1))
            if page in self.headings and without_marks(match.group(2)) not in self.headings[page]:
                yield match, f'cites "{match.group(2)}", a heading that {page} does not have'
        for match in IDENTIFIER.finditer(text):
            for word in filter(None, match.groups()):
                if word not in self.words and not word.startswith(OTHER_LIBRARIES):
                    yield match, f"cites {match.group()}, but {word} is not in the code"
        for match in FIGURE.finditer(text):
            known = self.constants.get(match.group(1), set())
            if known and float(match.group(2).rstrip(".")) not in known:
                yield match, f"cites {match.group(1)} as {match.group(2)}, the code has {', '.join(map(str, sorted(known)))}"

    def __call__(self, path, text):
        if not SKIPPED.search(path):
            text = comments_of(path, text)
            for match, what in self.missing(path, text):
                yield text.count("\n", 0, match.start()) + 1, what
