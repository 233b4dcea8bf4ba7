#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""README.md links every document; each document begins with a paragraph "For …", which names its reader; all links between documents
lead to an existing file and heading. usage: tests/documents.py [FOLDER of the sources]"""
import os
import re
import sys

SOURCE = sys.argv[1] if len(sys.argv) > 1 else os.path.join(os.path.dirname(os.path.abspath(__file__)), "..")
LINK = re.compile(r"\]\(([^)\s]+)\)")
SPOKEN_FOR = {"CHANGELOG.md", "README.md"}  # need no sentence


def documents():
    """Paths of all documents, relative to the sources."""
    top = [name for name in os.listdir(SOURCE) if name.endswith(".md")]
    below = [os.path.relpath(os.path.join(folder, name), SOURCE)
             for folder, _, names in os.walk(os.path.join(SOURCE, "docs")) for name in names if name.endswith(".md")]
    return sorted(top + below)


def read(path):
    with open(os.path.join(SOURCE, path), encoding="utf-8") as file:
        return file.read()


def links(path):
    """Line number, file relative to the sources and heading of each link to a file."""
    for number, line in enumerate(re.sub(r"```.*?```", lambda m: "\n" * m.group().count("\n"), read(path), flags=re.S).split("\n"), 1):
        for target in LINK.findall(line):
            if "://" in target or target.startswith("mailto:"):
                continue
            file, _, heading = target.partition("#")
            yield number, os.path.normpath(os.path.join(os.path.dirname(path), file)) if file else path, heading


def anchors(path):
    """The anchors of the headings, as GitHub makes them."""
    text = re.sub(r"```.*?```", "", read(path), flags=re.S)
    return {re.sub(r"[^\w\- ]", "", heading.lower()).strip().replace(" ", "-") for heading in re.findall(r"^#+ +(.*)$", text, flags=re.M)}


def faults():
    known = documents()
    listed = {file for _, file, _ in links("README.md")}
    for path in known:
        if path != "README.md" and path not in listed and os.path.dirname(path) not in listed:
            yield f"README.md: does not list {path}"
        paragraphs = [part for part in read(path).split("\n\n") if not part.startswith("#")]
        if path not in SPOKEN_FOR and not (paragraphs and paragraphs[0].lstrip().startswith("For ")):
            yield f"{path}: does not begin with \"For …\": its reader, and when"
        for number, file, heading in links(path):
            if not os.path.exists(os.path.join(SOURCE, file)):
                yield f"{path}:{number}: found a link to {file}, which does not exist"
            elif heading and file.endswith(".md") and heading not in anchors(file):
                yield f"{path}:{number}: found a link to {file}#{heading}, expected one of its headings"


def main():
    found = list(faults())
    print("\n".join(found) or f"{len(documents())} documents, all listed")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
