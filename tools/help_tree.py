# SPDX-License-Identifier: MIT
# Parses the --help output of the programs into a tree, for the completions and for the check of the man pages.
import os
import re
import subprocess

PROGRAMS = {
    "prismd": "daemon/prismd",
    "prismctl": "tools/prismctl/prismctl",
    "prismcal": "tools/prismcal/prismcal",
    "prismsim": "tools/prismsim/prismsim",
    "prismrelay": "tools/prismrelay/prismrelay",
    "prismweb": "tools/prismweb/prismweb",
    "prism-import": os.path.join(os.path.dirname(os.path.abspath(__file__)), "prism-import/prism_import.py"),
}
SECTIONS = ("Options", "Further options")
HELP_COLUMN = 30  # if only one blank follows a value, the help text is found by its column


def is_continued(line):
    return re.match(r" {10,}\S", line)


def read(program, words=()):
    """{"options": [(names, takes a value, help)], "commands": {name: (help, tree)}, "examples": [line], "text": all of
    it} of a program or its subcommand."""
    text = subprocess.run([program, *words, "--help"], check=True, capture_output=True, text=True).stdout
    options, commands, examples, section = [], {}, [], ""
    lines = text.splitlines()
    for line, following in zip(lines, [*lines[1:], ""]):
        if re.match(r"\S.*:$", line):
            section = line[:-1]
        entry = re.match(r"  (\S+)(.*)", line)
        if entry and section in SECTIONS:
            parts = re.split(r"\s{2,}", entry[2], maxsplit=1)
            if len(parts) == 1 and line[HELP_COLUMN - 1 : HELP_COLUMN] == " " and not is_continued(following):
                parts = [line[:HELP_COLUMN].split(maxsplit=1)[1], line[HELP_COLUMN:]]
            # Without a value, the help text follows the name after at least two blanks.
            value, help_text = parts[0].strip(), parts[1] if len(parts) > 1 else ""
            options.append([entry[1].split(","), value != "", help_text])
        elif entry and section == "Subcommands":
            commands[entry[1]] = (entry[2].strip(), read(program, (*words, entry[1])))
        elif section == "Examples" and line.startswith("  "):
            examples.append(line.strip())
        elif section in SECTIONS and options and is_continued(line):
            options[-1][2] = (options[-1][2] + " " + line.strip()).strip()
    return {"options": options, "commands": commands, "examples": examples, "text": text}


def names(tree):
    """Every option and every command in a tree."""
    found = {name for option in tree["options"] for name in option[0]}
    for command, (_, below) in tree["commands"].items():
        found |= {command} | names(below)
    return found
