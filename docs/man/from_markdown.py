#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
# Converts pages of docs/ to a scdoc man page. usage: from_markdown.py NAME SECTION "DESCRIPTION" FILE...
# Supports headings, tables, lists, quotes, fenced and indented code, `code`, **bold**, *italic*, [links](to).
import re
import sys


def plain(text):
    return re.sub(r"([\\*_])", r"\\\1", text)


def literal(lines):
    """A block of code; scdoc takes a backslash in it for an escape, too."""
    return ["", "```", *(line.replace("\\", "\\\\") for line in lines), "```", ""]


def inline(text):
    """Converts `code` and **bold** to bold and links to their text; escapes scdoc formatting."""
    out = ""
    for part in re.split(r"(`[^`]+`|\*\*[^*]+\*\*|\B\*\w[^*]*\*|\[[^\]]+\]\([^)]+\))", text):
        if part.startswith("`"):
            out += f"*{plain(part[1:-1])}*"
        elif part.startswith("**"):
            out += f"*{plain(part[2:-2])}*"
        elif part.startswith("*"):
            out += f"_{plain(part[1:-1])}_"
        elif re.fullmatch(r"\[[^\]]+\]\([^)]+\)", part):
            out += inline(re.match(r"\[([^\]]+)\]", part)[1])
        else:
            out += plain(part)
    return re.sub(r"^([.'#-])", r"\\\1", out)


def cells(line):
    return [cell.strip() for cell in re.split(r"(?<!\\)\|", line.strip().strip("|"))]


def table(rows):
    """Writes each row as its first cell and an indented rest, after a line of headings if any. Tables with over 4 columns stay tables."""
    heading, lines = cells(rows[0]), []
    if len(heading) > 4:
        return literal([rows[0], *rows[2:]])
    if any(heading[1:]):
        lines += [f"_{plain(' – '.join(h for h in heading if h))}_", ""]
    for row in map(cells, rows[2:]):
        rest = " – ".join(inline(cell) for cell in row[1:] if cell)
        lines += [inline(row[0]) or r"\-", "\t" + (rest or r"\-"), ""]
    return lines


def blocks(text):
    """Yields (type, lines) of a document: code without its fence or indentation, a table, or one line of text."""
    lines = text.split("\n")
    while lines:
        line = lines.pop(0)
        if line.startswith("```"):
            end = next(i for i, l in enumerate(lines) if l.startswith("```"))
            yield "code", lines[:end]
            del lines[:end + 1]
        elif line.startswith("    "):
            end = next((i for i, l in enumerate(lines) if l and not l.startswith("    ")), len(lines))
            code = [l[4:] for l in [line, *lines[:end]]]
            del lines[:end]
            while not code[-1]:
                code.pop()
            yield "code", code
        elif line.startswith("|"):
            end = next((i for i, l in enumerate(lines) if not l.startswith("|")), len(lines))
            yield "table", [line, *lines[:end]]
            del lines[:end]
        else:
            yield "text", [line]


def page(text):
    out = []
    for kind, lines in blocks(text):
        if kind == "code":
            out += literal(lines)
        elif kind == "table":
            out += table(lines)
        elif lines[0].startswith("#"):
            marks, title = lines[0].split(" ", 1)
            out += ["", "# " + plain(title).upper() if len(marks) < 3 else "## " + plain(title), ""]
        elif re.match(r"- |\d+\. ", lines[0]):
            out += ["", "- " + inline(re.sub(r"^(- |\d+\. )", "", lines[0]))]
        else:
            out.append(inline(re.sub(r"^> ", "", lines[0]).strip()))
    return out


def main():
    name, section, what, *files = sys.argv[1:]
    out = [f"{name}({section})", "", "# NAME", "", f"{name} - {what}", ""]
    for file in files:
        out += page(open(file, encoding="utf-8").read())
    out += ["", "# SEE ALSO", "", "*prismd*(8), *prismd.json*(5), *prismctl*(1)"]
    # scdoc allows one empty line at most and requires indented continuation lines in list items.
    text = re.sub(r"\n{3,}", "\n\n", "\n".join(out))
    text = re.sub(r"(?m)^(- .*)\n((?:(?!- |```|#|\t|$).+\n)+)", lambda m: m[1] + "\n" + re.sub("(?m)^", "  ", m[2].rstrip("\n")) + "\n", text)
    print(text)


main()
