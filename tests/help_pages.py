#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
# Checks that --help is readable: no type names or validators of the code, and for each command examples with existing options.
# usage: help_pages.py BUILD; --self-test checks that each kind of error is found.
import os
import re
import shlex
import sys

sys.dont_write_bytecode = True
sys.path.insert(0, os.path.join(os.path.dirname(os.path.dirname(os.path.abspath(__file__))), "tools"))
import help_tree

# "ENUM:value in {decade->1,...} OR {1,2,0}", "INT:INT in [1 - 256]=20", "--hours Excludes: --cycles"
OF_THE_CODE = r"\b(?:INT|UINT|FLOAT|TEXT|ENUM):\S.*|->|\bin [\[{]|\b(?:ENUM|FLOAT|UINT|REQUIRED)\b|\b(?:Excludes|Needs):"


MOST_FIRST = 25  # options of the first section of a command; more hide those that every user needs


def breaches(name, tree, above=frozenset()):
    """Yields errors. `name`: program and command ("prismcal allan"). `above`: options of the program, which commands also accept."""
    for found in re.findall(OF_THE_CODE, tree["text"]):
        yield f"{name} --help: found \"{found}\", expected readable text"
    first = len(re.findall(r"^  -", tree["text"].partition("\nFurther options:")[0], re.M))
    if " " in name and first > MOST_FIRST:
        yield f"{name} --help: found {first} options in the first section, expected at most {MOST_FIRST}"
    known = above | {option for names, _, _ in tree["options"] for option in names}
    if not tree["examples"]:
        yield f"{name} --help: found no examples, expected one or more"
    for example in tree["examples"]:
        words = shlex.split(example)
        if words[0] != name.split()[0] or not set(name.split()) <= set(words):
            yield f"{name} --help: found the example \"{example}\", expected one of {name}"
        options = {word for word in words if word.startswith("-")}
        if tree["commands"]:
            options &= known  # the command's own options are checked below
        for option in sorted(options - known):
            yield f"{name} --help: found {option} in an example, expected an existing option"
    for command, (_, below) in tree["commands"].items():
        yield from breaches(f"{name} {command}", below, known)


def self_test():
    def tree(text="", options=("--rate",), examples=("prismd run --rate 2",)):
        return {"text": text, "options": [(options, True, "")], "commands": {}, "examples": list(examples)}

    planted = [tree("--grid ENUM:value in {a->1}"), tree("--count INT:INT in [1 - 256]=20"), tree("--out TEXT REQUIRED"),
               tree(examples=()), tree("  -x\n" * (MOST_FIRST + 1)), tree(examples=["prismd run --gone"]), tree(examples=["prismd walk"])]
    missed = [case for case in planted if not list(breaches("prismd run", case))]
    if list(breaches("prismd run", tree("--rate N   how many (1 to 256; default 20)"))) or missed:
        sys.exit(f"an injected error was not found, or correct help was rejected; not found: {missed}")


def main():
    if sys.argv[1:] == ["--self-test"]:
        return self_test()
    found = []
    for program, path in help_tree.PROGRAMS.items():
        found += breaches(program, help_tree.read(os.path.join(sys.argv[1], path)))
    sys.exit("\n".join(found) or 0)


main()
