#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Converts a terminal's screen to SVG: `tmux capture-pane -p -e` on standard input, the picture on standard output."""
import re
import sys
from html import escape

CELL_PX = (8.4, 18)  # width and height of a character at 14 px
COLOURS = ["#1e2430", "#e06c75", "#7fbf6a", "#e0b464", "#61afef", "#c678dd", "#56b6c2", "#d7dae0"]
PLAIN = COLOURS[7]
NO_BREAK = "\u00a0"  # SVG does not draw a space at an edge, or the second of two


def styled(line, style):
    """Yields (text, style) of a line; the style continues in the next line, as on a terminal."""
    for escape_codes, text in re.findall(r"((?:\x1b\[[0-9;]*m)*)([^\x1b]*)", line):
        for code in re.findall(r"\d+", escape_codes.replace("[m", "[0m")):
            number = int(code)
            if number == 0:
                style = {"fill": PLAIN}
            elif number == 1:
                style = {**style, "font-weight": "bold"}
            elif number == 2:
                style = {**style, "opacity": "0.6"}
            elif number == 7:
                style = {**style, "reverse": True}
            elif number == 39:
                style = {**style, "fill": PLAIN}
            elif 30 <= number <= 37 or 90 <= number <= 97:
                style = {**style, "fill": COLOURS[number % 10]}
        if text:
            yield text, style
    yield "", style


def main():
    lines = sys.stdin.read().rstrip("\n").split("\n")
    width = max(len(re.sub(r"\x1b\[[0-9;]*m", "", line)) for line in lines)
    w, h = CELL_PX
    size = (width * w + 24, len(lines) * h + 20)
    print(f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {size[0]:.0f} {size[1]:.0f}" '
          f'font-family="DejaVu Sans Mono, Menlo, Consolas, monospace" font-size="14">')
    print(f'<rect width="100%" height="100%" rx="6" fill="{COLOURS[0]}"/>')
    style = {"fill": PLAIN}
    for row, line in enumerate(lines):
        column = 0
        for text, style in styled(line, style):
            at = (12 + column * w, 10 + row * h)
            shown = {key: value for key, value in style.items() if key != "reverse"}
            if style.get("reverse") and text:
                print(f'<rect x="{at[0]:.1f}" y="{at[1]:.0f}" width="{len(text) * w:.1f}" height="{h}" fill="{style["fill"]}"/>')
                shown["fill"] = COLOURS[0]
            attributes = "".join(f' {key}="{value}"' for key, value in shown.items())
            if text.strip():
                print(f'<text x="{at[0]:.1f}" y="{at[1] + 14:.0f}" textLength="{len(text) * w:.1f}"{attributes}>{escape(text).replace(" ", NO_BREAK)}</text>')
            column += len(text)
    print("</svg>")


if __name__ == "__main__":
    main()
