#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
# Checks the code rules of the tree: includes, first lines, waiting. --self-test checks that a violation of each
# rule is found.
import os
import re
import sys
import tempfile

sys.dont_write_bytecode = True
import citations
import frame_path
import house_names

ROOT = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
SKIPPED_DIRS = {"build", "prism-demo"}
SPDX = "SPDX-License-Identifier: MIT"

BASE = "base"
CORE, TRAINING, EVALUATION = "compensation", "compensation/training", "compensation/evaluation"
WIRE, DRIVERS, CONFIG, PIPELINE = "drivers/wire", "drivers", "config", "daemon/pipeline"
DAEMON, TOOLS, TESTS = "daemon", "tools", "tests"
LINE, LOG, SOCKET = "daemon/line", "daemon/log", "daemon/socket"
DESCRIPTION, DECODE, ENCODE = "drivers/wire/description", "drivers/wire/decode", "drivers/wire/encode"
WIRES = {DESCRIPTION, DECODE, ENCODE, WIRE}
# the first match is the module
ROOMS = [BASE, TRAINING, EVALUATION, CORE, DESCRIPTION, DECODE, ENCODE, WIRE, DRIVERS, CONFIG, PIPELINE, LINE, LOG, SOCKET, DAEMON, TOOLS, TESTS]

# module: (modules it may include, other headers it may never include)
SLOW = r"boost/asio|spdlog/|CLI/|pcap|systemd/"
PURE = SLOW + r"|thread$|mutex$|future$|condition_variable$|fstream$|iostream$|filesystem$"
MAY = {
    BASE: ({BASE}, "boost/|spdlog/|CLI/|pcap|Eigen/"),
    CORE: ({BASE, CORE}, PURE + "|boost/"),
    TRAINING: ({BASE, CORE, TRAINING, EVALUATION}, SLOW + r"|fstream$|iostream$|filesystem$|boost/(?!math/)"),
    EVALUATION: ({BASE, CORE, EVALUATION}, PURE + "|boost/(?!math/)"),
    DESCRIPTION: ({BASE, DESCRIPTION}, PURE + "|boost/(?!container/)"),
    DECODE: ({BASE, DESCRIPTION, DECODE}, PURE + "|boost/(?!container/)"),
    ENCODE: ({BASE, DESCRIPTION, ENCODE}, PURE + "|boost/(?!container/)"),
    WIRE: (set(), "."),  # all files are in submodules
    DRIVERS: (WIRES | {BASE, DRIVERS}, "spdlog/|CLI/|systemd/"),
    CONFIG: (WIRES | {BASE, CORE, DRIVERS, CONFIG}, "boost/asio|spdlog/|CLI/"),
    PIPELINE: (WIRES | {BASE, CORE, DRIVERS, CONFIG, PIPELINE}, SLOW + r"|thread$|mutex$"),
    LINE: (WIRES | {BASE, CORE, DRIVERS, CONFIG, PIPELINE, LINE}, "spdlog/|CLI/|pcap|systemd/"),
    LOG: (WIRES | {BASE, CORE, DRIVERS, CONFIG, PIPELINE, LOG}, SLOW),
    SOCKET: (WIRES | {BASE, CORE, DRIVERS, CONFIG, PIPELINE, SOCKET}, "spdlog/|CLI/|pcap|systemd/"),
    DAEMON: (WIRES | {BASE, CORE, DRIVERS, CONFIG, PIPELINE, LINE, LOG, SOCKET, DAEMON}, "(?!)"),
    TOOLS: (WIRES | {BASE, CORE, TRAINING, EVALUATION, DRIVERS, CONFIG, PIPELINE, TOOLS}, "(?!)"),
    TESTS: (set(ROOMS), "(?!)"),
}
# module: libraries that its CMakeLists.txt may never use
ASYNC = r"prism_boost|spdlog|PCAP|SYSTEMD|CLI11"
MAY_NOT_LINK = {
    BASE: "prism_boost|Boost::|spdlog|PCAP|CLI11|Eigen|prism_(?!base)",
    CORE: ASYNC + "|Boost::|Threads::|prism_(?:wire|clock|drivers|simulation|config|daemon|training|evaluation)",
    TRAINING: ASYNC + "|prism_(?:wire|clock|drivers|simulation|config|daemon)",
    EVALUATION: ASYNC + "|Threads::|prism_(?:wire|clock|drivers|simulation|config|daemon|training)",
    WIRE: ASYNC + "|Threads::|prism_(?:compensation|training|evaluation|drivers|config|daemon)",
    DRIVERS: "spdlog|SYSTEMD|CLI11|prism_(?:compensation|training|evaluation|config|daemon)",
    CONFIG: ASYNC + "|prism_(?:daemon|training|evaluation)",
    PIPELINE: ASYNC + "|Threads::|prism_(?:daemon|training|evaluation|simulation)",
    LINE: "spdlog|PCAP|SYSTEMD|CLI11|prism_(?:log|socket|daemon|training|evaluation|simulation)",
    LOG: ASYNC + "|prism_(?:line|socket|daemon|training|evaluation|simulation)",
    SOCKET: "spdlog|PCAP|SYSTEMD|CLI11|prism_(?:line|log|daemon|training|evaluation|simulation)",
    DAEMON: "prism_(?:training|evaluation|simulation)",
    TOOLS: "prism_daemon",
}
# headers of base that read files, start threads or notify systemd; modules that only compute may not include them
WAITING = {"base/disk_thread.hpp", "base/notify.hpp", "base/file.hpp"}
PURE_MODULES = {CORE, EVALUATION} | WIRES
ASYNC_WINGS = {LINE, SOCKET}  # they may include daemon/awaiting.hpp
CLOCKS = {"base/host_time.hpp"}
CLOCKLESS = {CORE, TRAINING, EVALUATION, PIPELINE} | WIRES
THROWLESS = {BASE, DRIVERS, CONFIG, PIPELINE, LINE, LOG, SOCKET, DAEMON} | WIRES
CLOCK = re.compile(r"\b\w+_clock::now\b|\bstd::time\s*\(|\bclock_gettime\s*\(|\bgettimeofday\s*\(")
# no program starts another one, so that a name from a file never reaches a shell; but prismcal Chromium, with paths of its own
STARTER = "tools/prismcal/html.cpp"
PROGRAM_CALL = re.compile(r"(?<![\w.])(?:popen|exec[lv]\w*|posix_spawnp?)\s*\(|(?:(?<![\w>&*] )|return )(?<![\w.])system\s*\(|<spawn\.h>")
JSON_READERS = re.compile(r"^compensation/(model_types|[a-z]+_text)\.[ch]pp$")


def room_of(path):
    return next((room for room in ROOMS if path.startswith(room + "/")), None)


def is_code(path):
    return path.endswith((".cpp", ".hpp"))


def is_script(path, text):
    return text.startswith("#!") or path.endswith((".py", ".sh"))


def line_of(text, offset):
    return text.count("\n", 0, offset) + 1


def blank(match):
    """Replaces the match by blanks; keeps length and lines."""
    return re.sub(r"[^\n]", " ", match.group())


def without_comments_and_texts(text):
    token = r'R"([^(]{0,16})\((?:.|\n)*?\)\1"|"(?:\\.|[^"\\\n])*"|(?<![0-9A-Fa-f])\'(?:\\.|[^\'\\\n])+\'|//[^\n]*|/\*(?:.|\n)*?\*/'
    return re.sub(token, blank, text)


def check_includes(path, text):
    room = room_of(path)
    if not is_code(path) or room is None:
        return
    rooms, never = MAY[room]
    for match in re.finditer(r'^\s*#\s*include\s*([<"])([^>"]+)[>"]', text, re.M):
        line, mark, name = line_of(text, match.start()), match.group(1), match.group(2)
        if mark == "<":
            if re.match(never, name):
                yield line, f"{room} may not include <{name}>"
            if room == CORE and name.startswith("nlohmann/") and not JSON_READERS.match(path):
                yield line, "in compensation only JSON readers may include nlohmann"
            continue
        if room in PURE_MODULES and name in WAITING:
            yield line, f'{room} may not include "{name}", which can block'
        if room in CLOCKLESS and name in CLOCKS:
            yield line, f'{room} may not include "{name}", which reads the clock'
        if name == "daemon/awaiting.hpp" and room in ASYNC_WINGS:
            continue
        target = room_of(name)
        if target is None or "../" in name:
            yield line, f'"{name}" is not relative to the root of the project'
        elif target not in rooms and not (room in WIRES | {DRIVERS} and house_names.VOCABULARY.match(name)):
            yield line, f"{room} may not include {target} ({name})"


def check_links(path, text):
    room = room_of(path)
    if not path.endswith("CMakeLists.txt") or room not in MAY_NOT_LINK:
        return
    for command in re.finditer(r"(?:\bLINK\b|target_link_libraries)[^)]*", re.sub(r"#[^\n]*", blank, text)):
        for match in re.finditer(rf"\b(?:{MAY_NOT_LINK[room]})\w*", command.group()):
            yield line_of(text, command.start() + match.start()), f"{room} may not link {match.group()}"


def check_clocks(path, text):
    if is_code(path) and room_of(path) in CLOCKLESS:
        for match in CLOCK.finditer(without_comments_and_texts(text)):
            yield line_of(text, match.start()), f"{room_of(path)} may not read the clock ({match.group().strip()})"


def check_programs(path, text):
    if not is_code(path) or room_of(path) in {None, TESTS} or path == STARTER:
        return
    found = list(PROGRAM_CALL.finditer(without_comments_and_texts(text))) + list(re.finditer("/bin/(?:ba|da)?sh\\b", text))
    for match in found:
        yield line_of(text, match.start()), f"{path} may not start a program ({match.group().strip()})"


def check_file_system(path, text):
    """std::filesystem throws without an error_code, and a range-for over a directory always can. A disk error must not end a daemon."""
    if not is_code(path) or room_of(path) not in THROWLESS:
        return
    code = without_comments_and_texts(text)
    errors = set(re.findall(r"\bstd::error_code\s*&?\s*(\w+)", code))
    for match in re.finditer(r"\b(?:fs|filesystem)::(?!path\b)(\w+)(?:\s+\w+)?\s*\(", code):
        end, depth = match.end(), 1
        while depth > 0 and end < len(code):
            depth += (code[end] == "(") - (code[end] == ")")
            end += 1
        if not errors & set(re.findall(r"\w+", code[match.end() : end])):
            yield line_of(text, match.start()), f"{match.group(1)} without an error_code throws"
    for match in re.finditer(r"\bfor\s*\([^;(){}]*(?<!:):(?!:)[^;{}]*\b(?:recursive_)?directory_iterator\b", code):
        yield line_of(text, match.start()), "a range-for over a directory throws: use increment(error)"


STREAMS = re.compile(r"\bstd::(?:basic_)?[io]?fstream\b|\bfopen\s*\(")


def check_files_and_json(path, text):
    """base/file.hpp must open all files: it never blocks on a pipe or writes through a link. json_text() must write all JSON: it never
    throws."""
    if not is_code(path) or room_of(path) in (None, BASE, TESTS):
        return
    code = without_comments_and_texts(text)
    for match in STREAMS.finditer(code):
        yield line_of(text, match.start()), f"{match.group()} also opens pipes and links: expected base/file.hpp"
    for match in re.finditer(r"\.dump\s*\(", code):
        yield line_of(text, match.start()), "dump() throws on text that is not UTF-8: expected json_text()"


def check_first_lines(path, text):
    cmake = path.endswith((".cmake", "CMakeLists.txt"))
    if not (is_code(path) or is_script(path, text) or cmake):
        return
    lines = text.split("\n")
    at = 1 if lines[0].startswith("#!") else 0
    comment = "// " if is_code(path) else "# "
    if len(lines) <= at or lines[at] != comment + SPDX:
        yield at + 1, f"expected the line '{comment}{SPDX}'"
    elif path.endswith(".hpp") and not re.match(r"// \S.{15,}", lines[at + 1] if len(lines) > at + 1 else ""):
        yield at + 2, "expected one line with the purpose of the header"


# Examples of 0.2: prismctl's rows and prismweb's archive.
BY_MESSAGE = re.compile(r"(?:\btext\(\)|\bwhat)\.(?:find|starts_with|ends_with|compare)\(")


def check_decisions(path, text):
    if is_code(path) and not path.startswith(TESTS):
        for match in BY_MESSAGE.finditer(without_comments_and_texts(text)):
            yield line_of(text, match.start()), "decides by the text of an error: expected a code (config/socket_protocol.hpp)"


def opens_block(before):
    """Returns true if a '{' after the text `before` opens a block, not a value."""
    before = before.rstrip()
    word = re.search(r"(\w+)$", before)
    if word:
        return word.group() in {"else", "do", "try", "const", "noexcept", "mutable", "override", "final"}
    return not before or before[-1] in ");{}>"


def statement_around(code, offset):
    """Returns the range of the statement with the co_await at `offset`; for an if or a while, of its condition."""
    begin, depth = offset, 0
    while begin > 0:
        c = code[begin - 1]
        if c in ")]}":
            depth += 1
        elif c in "([":
            depth -= 1
        elif c == "{":
            if depth <= 0 and opens_block(code[: begin - 1]):
                break
            depth -= 1
        elif c == ";" and depth <= 0:
            break
        if c == "}" and depth == 1 and re.match(r"\s*[\w*]", code[begin:]):
            break  # the block before this statement
        begin -= 1
    end, depth = offset, 0
    while end < len(code):
        c = code[end]
        if c == ";" and depth <= 0 or c == "{" and opens_block(code[:end]) and depth <= 0:
            break
        depth += (c in "([{") - (c in ")]}")
        end += 1
    return begin, end


def check_waiting(path, text):
    """g++ 12.2 destroys objects made by braces or a capturing lambda in the full expression of a co_await twice."""
    if not is_code(path) or "co_await" not in text:
        return
    code, seen = without_comments_and_texts(text), set()
    for match in re.finditer(r"\bco_await\b", code):
        begin, end = statement_around(code, match.start())
        statement, line = code[begin:end], line_of(code, match.start())
        if begin in seen:
            yield line, "a second co_await in one statement"
        seen.add(begin)
        if re.search(r"(?<![\w\])])\[[^\]]+\]\s*[({m]", statement.replace("auto [", "auto  ").replace("auto& [", "auto&  ")):
            yield line, "a capturing lambda in the statement of a co_await: name it first"
        elif "{" in statement:
            yield line, "a brace in the statement of a co_await: name it first"


def check_traps(path, text):
    """A trap in a test replaces the one of lib.sh, and its commands change the exit code: the test could not fail."""
    if re.match(r"tests/(?:system|faults)/\d", path):
        for match in re.finditer(r"^\s*trap\b", text, re.M):
            yield line_of(text, match.start()), "a trap hides the exit code: expected at_exit of tests/system/lib.sh"


LEAVES_EARLY = re.compile(r"\bprism(?:cal|d) [^|\n]*\| *(?:head\b|grep -\w*q|awk [^|\n]*\bexit\b|sed [^|\n]*\dq)")


def check_pipes(path, text):
    """A reader that leaves before the program has written all kills it, and under pipefail the test: on a loaded machine only."""
    if re.match(r"tests/.*\.sh$", path):
        for match in LEAVES_EARLY.finditer(text):
            yield line_of(text, match.start()), "the reader of this pipe leaves early: expected one that reads to the end"


def check_names(path, text):
    if is_code(path):
        for offset, message in house_names.check_namespaces(path, without_comments_and_texts(text)):
            yield line_of(text, offset), message


class UniqueTypes:
    """No two types of the tree have the same full name."""

    def __init__(self):
        self.first = {}  # full name: first location

    def __call__(self, path, text):
        if not is_code(path):
            return
        for offset, name in house_names.types_of(path, without_comments_and_texts(text)):
            line = line_of(text, offset)
            first = self.first.setdefault(name, f"{path}:{line}")
            if first != f"{path}:{line}":
                yield line, f"a second type {name}, as in {first}: expected one name for one type"


class Steps:
    """A file of prismcal includes only files of its own row of the table in docs/architecture.md and of the rows above; a file without a row
    is in the last one."""

    def __init__(self, files):
        table = dict(files).get("docs/architecture.md", "").partition("### The steps of prismcal\n")[2].partition("\n#")[0]
        self.rows = {name: row for row, line in enumerate(table.split("\n")) for name in re.findall(r"`(\w+)`", line)}

    def row_of(self, path):
        return self.rows.get(os.path.basename(path).partition(".")[0], sys.maxsize)

    def __call__(self, path, text):
        for match in re.finditer(r'(?m)^#include "(tools/prismcal/[^"]+hpp)"', text if path.startswith("tools/prismcal/") else ""):
            if self.row_of(match[1]) > self.row_of(path):
                yield line_of(text, match.start()), f"{path} may not include {match[1]}, a later step of prismcal (docs/architecture.md)"


RULES = [check_includes, check_links, check_clocks, check_programs, check_file_system, check_files_and_json, check_first_lines,
         check_decisions, check_waiting, check_traps, check_pipes, check_names]


def files_of(root):
    for folder, folders, names in os.walk(root):
        hidden = {name for name in folders if name.startswith(".") and name != ".ci"}
        folders[:] = sorted(set(folders) - SKIPPED_DIRS - hidden)
        for name in sorted(names):
            path = os.path.join(folder, name)
            if os.path.isfile(path) and not os.path.islink(path):
                yield os.path.relpath(path, root).replace(os.sep, "/"), path


def breaches(root):
    files = []
    for path, full in files_of(root):
        with open(full, "rb") as file:
            files.append((path, file.read().decode("utf-8", errors="replace")))
    rules = RULES + [UniqueTypes(), Steps(files), citations.Citations(files), frame_path.FramePath(files)]
    for path, text in files:
        for line, what in sorted(breach for rule in rules for breach in rule(path, text)):
            yield f"{path}:{line}: {what}"


CASES = os.path.join(ROOT, "tests", "house_rules_cases.txt")
HEADS = {".cpp": f"// {SPDX}\n", ".hpp": f"// {SPDX}\n// A header with its purpose.\n#pragma once\n", ".md": "", ".js": "", "": f"#!/bin/sh\n# {SPDX}\n"}


def plant(folder, block):
    """Writes the files of a block of cases; returns the path and the expected message of the first."""
    files = re.findall(r"(?m)^([!+]?)(\S+)(?: \| (.*))?\n((?:  .*\n)*)", block + "\n")
    for mark, path, _, content in files:
        full = os.path.join(folder, path)
        os.makedirs(os.path.dirname(full), exist_ok=True)
        with open(full, "w", encoding="utf-8") as file:
            file.write("" if mark == "!" else HEADS.get(os.path.splitext(path)[1], f"# {SPDX}\n"))
            file.write(re.sub("(?m)^  ", "", content))
    return files[0][1:3]


def self_test():
    with open(CASES, encoding="utf-8") as file:
        blocks = re.sub(r"(?m)^#.*\n", "", file.read()).strip("\n").split("\n\n")
    failures = []
    with tempfile.TemporaryDirectory() as sound:
        for block in blocks:
            with tempfile.TemporaryDirectory() as folder:
                path, expected = plant(folder, block)
                found = list(breaches(folder))
            if not expected:
                plant(sound, block)
            elif len(found) != 1 or expected not in found[0] or not found[0].startswith(path + ":"):
                failures.append(f"expected one '{expected}', found {found}:\n{block}")
        failures += [f"correct code was rejected: {line}" for line in breaches(sound)]
        correct = len(list(files_of(sound)))
    print(*failures, f"code rules, self-test: {len(failures)} failures in {len(blocks)} cases, {correct} of correct files", sep="\n")
    return 1 if failures or correct < 10 else 0


def main(arguments):
    if arguments == ["--self-test"]:
        return self_test()
    if arguments:
        print("usage: house_rules.py [--self-test]", file=sys.stderr)
        return 64
    found = list(breaches(ROOT))
    for line in found:
        print(line)
    print(f"code rules: {len(found)} violations in {sum(1 for _ in files_of(ROOT))} files")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
