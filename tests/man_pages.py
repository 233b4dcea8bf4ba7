#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
# Checks that each man page has the options and subcommands of --help, and no others.
# usage: man_pages.py BUILD; --self-test checks that each kind of error is found.
import os
import re
import sys

sys.dont_write_bytecode = True
ROOT = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
sys.path.insert(0, os.path.join(ROOT, "tools"))
import help_tree

PAGES = {"prismd": "prismd.8.scd", "prismctl": "prismctl.1.scd", "prismcal": "prismcal.1.scd", "prismsim": "prismsim.1.scd",
         "prismrelay": "prismrelay.8.scd", "prismweb": "prismweb.8.scd", "prism-import": "prism-import.1.scd"}


def differences(program, known, page):
    bold = set(re.findall(r"\*([A-Za-z0-9-]+)\*", page))
    for name in sorted(known - {"-h"} - bold):
        yield f"{name} is in --help but not in the page, expected *{name}*"
    of_others = rf"\*?prism(?!{program[5:]}\b)-?\w+\*?(?:\(\d\))? +\*?--?[a-z][a-z-]*"
    written = set(re.findall(r"(?<![\w-])(--[a-z][a-z0-9-]*|-[a-z])\b", re.sub(of_others, "", page)))
    for name in sorted(written - known):
        yield f"found {name}, which --help does not list"


def self_test():
    known, page = {"-h", "--help", "--rate", "-s", "run"}, "*--help* *--rate* *-s* *run* and prismsim --other"
    cases = [(known | {"--new"}, page), (known | {"new"}, page), (known, page + " *--gone*"), (known, page + " [-x]"),
             (known, page.replace("prismsim", "prismd"))]
    missed = [case for case in cases if not list(differences("prismd", *case))]
    if list(differences("prismd", known, page)) or missed:
        sys.exit(f"an injected error was not found, or a correct page was rejected; not found: {missed}")


def main():
    if sys.argv[1:] == ["--self-test"]:
        return self_test()
    found = []
    for program, name in PAGES.items():
        path = os.path.join("docs/man", name)
        known = help_tree.names(help_tree.read(os.path.join(sys.argv[1], help_tree.PROGRAMS[program])))
        with open(os.path.join(ROOT, path)) as page:
            found += [f"{path}: {what}" for what in differences(program, known, page.read())]
    sys.exit("\n".join(found) or 0)


main()
