#!/usr/bin/python3
# SPDX-License-Identifier: MIT
# The one-line faults that tools/mutants may make in a C++ file, from python3-clang: another comparison, a sign, a bound or an integer by one,
# another first digit of a number, true for false, && for ||, a removed early return; not in constant expressions, attributes and macros, and
# not in statements with co_await.
# usage: faults.py     self-test: compares the faults of sample.cpp with faults.txt, and runs the sample with each of them
import contextlib
import difflib
import os
import re
import subprocess
import sys
import tempfile

try:
    import clang.cindex
except ImportError:
    print("skipped: /usr/bin/python3 has no module clang (tools/setup ci)")
    sys.exit(77 if __name__ == "__main__" else 1)

HERE = os.path.dirname(os.path.abspath(__file__))
SWITCH = f"{HERE}/switch.hpp"

OTHERS = {b"<": [b"<=", b">="], b"<=": [b"<", b">"], b">": [b">=", b"<="], b">=": [b">", b"<"], b"==": [b"!="], b"!=": [b"=="],
          b"&&": [b"||"], b"||": [b"&&"]}
SIGNS = {b"+": [b"-"], b"-": [b"+"], b"+=": [b"-="], b"-=": [b"+="]}
CONSTANT = {"STATIC_ASSERT", "ENUM_CONSTANT_DECL", "TYPE_ALIAS_DECL", "CXX_UNARY_EXPR", "DECL_REF_EXPR", "TEMPLATE_NON_TYPE_PARAMETER", ""}
FUNCTIONS = {"FUNCTION_DECL", "FUNCTION_TEMPLATE", "CXX_METHOD", "CONSTRUCTOR", "DESTRUCTOR", "CONVERSION_FUNCTION"}
LITERALS = {"INTEGER_LITERAL", "FLOATING_LITERAL", "CXX_BOOL_LITERAL_EXPR", "CALL_EXPR"}  # a literal such as 5s is a call
OPERATIONS = {"BINARY_OPERATOR", "COMPOUND_ASSIGNMENT_OPERATOR", "CALL_EXPR", "UNEXPOSED_EXPR"}


def kind_of(cursor):
    with contextlib.suppress(ValueError):  # a kind that the bindings do not know
        return cursor.kind.name
    return ""


def extent(cursor):
    return cursor.extent.start.offset, cursor.extent.end.offset


def is_number(cursor):
    return cursor.type.get_canonical().kind.value in range(3, 24)  # bool to long double


def other_literals(text):
    if text in (b"true", b"false"):
        return [b"false" if text == b"true" else b"true"]
    if match := re.fullmatch(rb"(0[xX][\da-fA-F']+|\d[\d']*)([uUlLzZ]*|[a-z]+)", text):
        digits = match[1].replace(b"'", b"")
        form, base = (b"0x%x", 16) if digits[:2] in (b"0x", b"0X") else (b"0%o", 8) if digits[:1] == b"0" != digits else (b"%d", 10)
        return [form % (int(digits, base) + step) + match[2] for step in (1, -1) if int(digits, base) + step >= 0]
    if re.fullmatch(rb"[\d'.]+([eE][+-]?\d+)?\w*", text):
        first = re.match(rb"[^1-9eE]*([1-9])", text) or re.match(rb"[^0]*(0)", text)
        return [text[:first.start(1)] + b"%d" % (int(first[1]) + 1 if first[1] < b"9" else 8) + text[first.end(1):]]
    return []


class Finder:
    """Collects the faults that may be made in the files of some folders, by file and extent, from a syntax tree of clang."""

    def __init__(self, folders, unit):
        self.found, files = {}, {}
        for cursor in unit.cursor.get_children():
            self.path = cursor.location.file.name if cursor.location.file else ""
            if self.path.startswith(tuple(folders)):
                self.data = files.get(self.path) or files.setdefault(self.path, open(self.path, "rb").read())
                self.visit(cursor, "TRANSLATION_UNIT", True, False)

    def offer(self, cursor, first, last, at, old, others, in_constexpr):
        """A fault in the code from `first` to `last` that replaces `old` at `at`."""
        around = self.data[self.statement(first):max(last, self.data.find(b";", first))]
        # g++ 12 destroys temporaries of a statement with co_await twice; code with a comment or a raw string does not fit in one line
        if cursor.location.file.name == self.path and not re.search(rb'\bco_|//|#|R"', around):
            begin = self.data.rfind(b"\n", 0, at) + 1
            self.found[self.path, first, last] = {
                "line": self.data.count(b"\n", 0, at) + 1, "lines": self.data.count(b"\n", first, last), "at": at, "old": old.decode(),
                "others": [other.decode() for other in others], "constexpr": in_constexpr,
                "text": [self.data[begin:at].decode().lstrip(), self.data[at + len(old):self.data.find(b"\n", at)].decode()]}

    def statement(self, at):
        return max(self.data.rfind(mark, 0, at) for mark in (b";", b"{", b"}")) + 1

    def visit(self, cursor, parent, live, in_constexpr):
        """`live` is false in constant expressions and in the initialisers of static storage."""
        kind, kids, (first, last), name = kind_of(cursor), list(cursor.get_children()), extent(cursor), cursor.location.offset
        text = self.data[first:last]
        if kind in CONSTANT or kind.endswith("_ATTR") or kind == "CALL_EXPR" and not live and text.startswith(b"["):  # constexpr x = [] {...}();
            return
        if kind in FUNCTIONS:
            body = max((extent(kid)[0] for kid in kids if kind_of(kid) == "COMPOUND_STMT"), default=last)
            live, in_constexpr = True, b"constexpr" in self.data[first:body]
            kids = [kid for kid in kids if kind_of(kid) in ("PARM_DECL", "COMPOUND_STMT") or kind == "CONSTRUCTOR" and extent(kid)[0] > name]
        elif kind in ("VAR_DECL", "FIELD_DECL", "PARM_DECL"):  # of their children, only the initialiser
            kids = [kid for kid in kids if re.match(rb"\w+[^\[:]*?[={(]", self.data[name:extent(kid)[0] + 1])]
            is_static = not parent.endswith(("_STMT", "_EXPR")) or re.search(rb"\b(static|const(expr|init))\b", self.data[self.statement(first):name])
            live, in_constexpr = live and not (kind == "VAR_DECL" and is_static), in_constexpr or kind == "FIELD_DECL"
        elif kind == "LAMBDA_EXPR":
            live = True
        elif kind == "CASE_STMT" or kind == "IF_STMT" and text[:12] == b"if constexpr":
            kids = kids[1:]
        elif kind == "COMPOUND_STMT" and live:
            for branch in [list(kid.get_children())[-1] for kid in kids[:-1] if kind_of(kid) == "IF_STMT"]:
                end = ([branch, *branch.get_children()] if kind_of(branch) == "COMPOUND_STMT" else [branch])[-1]
                at = extent(end)[0]
                if kind_of(end) == "RETURN_STMT" and not re.search(rb"\belse\s*$", self.data[:extent(branch)[0]][-20:]):
                    self.offer(end, at, at + 6, at, b"return", [b""], in_constexpr)
        if live and kind in LITERALS and other_literals(text) and self.data[first - 1:first] != b"<" and self.data[last:last + 1] != b">":
            self.offer(cursor, first, last, first, text, other_literals(text), in_constexpr)
        elif live and kind == "UNARY_OPERATOR" and re.match(rb"-[^-]", text) and is_number(cursor):
            self.offer(cursor, first, last, first, b"-", [b"+"], in_constexpr)
        elif live and kind in OPERATIONS and len(kids) >= 2:
            left, right = min(kids, key=extent), max(kids, key=extent)
            between = self.data[extent(left)[1]:extent(right)[0]]
            others = OTHERS.get(between.strip()) or is_number(left) and is_number(right) and SIGNS.get(between.strip())
            if others and (extent(left)[0], extent(right)[1]) == (first, last):
                self.offer(cursor, first, last, extent(left)[1] + len(between) - len(between.lstrip()), between.strip(), others, in_constexpr)
        for kid in kids:
            self.visit(kid, kind, live, in_constexpr)


def faults_of(folders, path, arguments):
    """All faults in the files of a translation unit that are in the folders."""
    sys.setrecursionlimit(20000)
    unit = clang.cindex.Index.create().parse(path, args=[*arguments, "-w"])
    if problems := [str(problem) for problem in unit.diagnostics if problem.severity >= 3]:
        raise RuntimeError(f"tools/mutants: clang cannot read {path}: {problems[0]}")
    return Finder(folders, unit).found


def with_faults(data, faults):
    """The text of a file with the switch of each fault; the lines keep their numbers."""
    for fault in sorted(faults, key=lambda fault: -fault["first"]):
        first, last, at, end = fault["first"], fault["last"], fault["at"], fault["at"] + len(fault["old"])
        chosen = b"::prism_mutant%b(%d)" % (b"_constexpr" if fault["constexpr"] else b"", fault["id"])
        before, after = data[first:last], (data[first:at] + fault["new"].encode() + data[end:last]).replace(b"\n", b" ")
        data = data[:first] + (b"(%b ? (%b) : (%b))" % (chosen, after, before) if after else b"if (!%b) return" % chosen) + data[last:]
    return data


def shown(fault, new):
    return f"{fault['text'][0]}[{fault['old']} -> {new}]{fault['text'][1]}"




def self_test():
    sample, left, results = f"{HERE}/sample.cpp", [], []
    with open(sample, "rb") as file:
        text = file.read()
    for (_, first, last), fault in faults_of([sample], sample, ["-std=c++20"]).items():
        left += [fault | {"first": first, "last": last, "new": new} for new in fault["others"]]
    with tempfile.TemporaryDirectory() as folder:
        program, reached = f"{folder}/program", f"{folder}/reached"
        clear = ["sh", "-c", 'env -i "$1"; exit $?', "sh", program]  # the switch then finds the variable of the shell
        while left:
            faults = []
            for fault in left:
                if not any(fault["first"] < each["last"] and each["first"] < fault["last"] for each in faults):
                    faults.append(fault | {"id": len(faults)})
            left = [fault for fault in left if not any(fault.items() <= each.items() for each in faults)]
            with open(f"{program}.cpp", "wb") as file:
                file.write(with_faults(text, faults))
            subprocess.run(["g++", "-std=c++20", "-w", "-include", SWITCH, f"{program}.cpp", "-o", program], check=True)
            with open(reached, "wb") as file:
                file.write(bytes(len(faults)))
            usual = subprocess.run([program], env={"PRISM_MUTANT_REACHED": reached}, check=True, stdout=subprocess.PIPE).stdout
            with open(reached, "rb") as file:
                marks = file.read()
            for fault in faults:
                output = subprocess.run(clear, env={"PRISM_MUTANT": str(fault["id"]), "PATH": os.environ["PATH"]}, timeout=10, check=False, stdout=subprocess.PIPE).stdout
                effect = ("differs" if output != usual else "same") if marks[fault["id"]] else "not reached" if output == usual else "differs, not reached"
                results.append((fault["line"], fault["at"], fault["first"], f"{fault['line']}: {shown(fault, fault['new'])} ({effect})\n"))
    found = [line for _, _, _, line in sorted(results)]
    with open(f"{HERE}/faults.txt", encoding="utf-8") as file:
        expected = file.read().splitlines(keepends=True)
    sys.stdout.writelines(difflib.unified_diff(expected, found, "faults.txt", "found"))
    print(f"{len(found)} faults, {len(expected)} expected")
    return found != expected


if __name__ == "__main__":
    sys.exit(self_test())
