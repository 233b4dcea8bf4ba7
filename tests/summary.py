#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
# Counts the tests of a run: each script once, each case of a unit program by gtest's own result, so that a case that is skipped
# inside a program is a skip. usage: tests/summary.py CTEST_XML GTEST_DIRECTORY NAMES_FILE TITLE
# Writes the names of failed and skipped tests with their reasons to NAMES_FILE; prints one line per reason and the counts, at most ten
# lines of 80 columns. Exit code 1 if a test failed or none ran.
import collections
import os
import re
import sys
import xml.etree.ElementTree as xml

LINES_MAX, COLUMNS = 7, 80


def cases_of(path):
    """Yields (name, state, reason) of a gtest program; nothing if it crashed before it wrote its results."""
    try:
        root = xml.parse(path).getroot()
    except (OSError, xml.ParseError):
        return
    program = os.path.basename(path)[: -len(".xml")]
    for case in root.iter("testcase"):
        name = f"{program}:{case.get('classname')}.{case.get('name')}"
        skip = case.find("skipped")
        if case.find("failure") is not None:
            yield name, "failed", case.find("failure").get("message").split("\n")[0]
        elif skip is not None:  # "FILE:LINE\nREASON"
            yield name, "skipped", skip.get("message").split("\n", 1)[-1].strip()
        elif case.get("status") == "run":
            yield name, "passed", ""


def results(ctest_xml, gtest_dir):
    for test in xml.parse(ctest_xml).getroot().iter("testcase"):
        name, status = test.get("name"), test.get("status")
        if status == "disabled":
            continue
        output = test.findtext("system-out") or ""
        cases = list(cases_of(os.path.join(gtest_dir, name + ".xml")))
        yield from cases
        if status == "notrun":
            skips = re.findall(r"^skipped: (.*)", output, re.M)
            yield (name, "skipped", skips[-1]) if skips else (name, "failed", "did not run")
        elif status == "fail" and not any(state == "failed" for _, state, _ in cases):
            yield name, "failed", "ended with an error" + (" after its last case" if cases else "")
        elif status == "run" and not cases:
            yield name, "passed", ""


def summary(found, names_file, title):
    count = collections.Counter(state for _, state, _ in found)
    with open(names_file, "w") as out:
        for name, state, reason in sorted(found):
            if state != "passed":
                out.write(f"{state} {name}: {reason}\n")
    lines = [f"failed: {name}: {reason}" for name, state, reason in sorted(found) if state == "failed"]
    reasons = collections.Counter(reason for _, state, reason in found if state == "skipped")
    lines += [f"skipped {number}: {reason}" for reason, number in reasons.most_common()]
    if len(lines) > LINES_MAX:
        lines = lines[: LINES_MAX - 1] + [f"and {len(lines) - LINES_MAX + 1} more"]
    lines = [line if len(line) <= COLUMNS else line[: COLUMNS - 1] + "…" for line in lines]
    if lines:
        lines.append(f"names and reasons: {os.path.relpath(names_file)}")
    return lines + [f"{title}: {count['passed']} passed, {count['failed']} failed, {count['skipped']} skipped"], count


def self_test():
    import tempfile
    with tempfile.TemporaryDirectory() as directory:
        def write(name, text):
            with open(os.path.join(directory, name), "w") as out:
                out.write(text)
        def of(*tests):
            write("ctest.xml", "<testsuite>" + "".join(
                f'<testcase name="{name}" status="{status}"><system-out>{out}</system-out></testcase>' for name, status, out in tests) + "</testsuite>")
            return sorted(results(os.path.join(directory, "ctest.xml"), directory))
        write("unit.a.xml", '<testsuites><testsuite><testcase name="One" status="run" result="completed" classname="A"/>'
              '<testcase name="Two" status="run" result="skipped" classname="A"><skipped message="a.cpp:3&#x0A;no x (../shared)"/></testcase>'
              '<testcase name="Off" status="notrun" result="suppressed" classname="A"/></testsuite></testsuites>')
        one, two = ("unit.a:A.One", "passed", ""), ("unit.a:A.Two", "skipped", "no x (../shared)")
        assert of(("unit.a", "run", "")) == [one, two]
        assert of(("unit.a", "fail", "")) == [("unit.a", "failed", "ended with an error after its last case"), one, two]
        assert of(("unit.b", "fail", "Segmentation fault")) == [("unit.b", "failed", "ended with an error")]
        assert of(("s", "notrun", "x\nskipped: no y (tools/setup all)\n")) == [("s", "skipped", "no y (tools/setup all)")]
        assert of(("s", "notrun", "Unable to find executable")) == [("s", "failed", "did not run")]
        assert of(("s", "run", "skipped: is a word of its output")) == [("s", "passed", "")]
        many = [(f"t{i}", "failed", "r" * 99) for i in range(30)] + [two]
        lines, count = summary(many, os.path.join(directory, "names"), "t")
        assert len(lines) <= 10 and all(len(line) <= COLUMNS for line in lines[:-2]), lines
        assert lines[-1] == "t: 0 passed, 30 failed, 1 skipped" and count["failed"] == 30


if __name__ == "__main__":
    if sys.argv[1:] == ["--self-test"]:
        self_test()
        sys.exit(0)
    ctest_xml, gtest_dir, names_file, title = sys.argv[1:]
    lines, count = summary(list(results(ctest_xml, gtest_dir)), names_file, title)
    print("\n".join(lines))
    sys.exit(1 if count["failed"] or not count["passed"] else 0)
