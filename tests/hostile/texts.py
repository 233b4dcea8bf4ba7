# SPDX-License-Identifier: MIT
"""Texts that a shell, SQL, HTML, a terminal, … would interpret, and a second implementation of the rules for names and texts."""
import unicodedata

TEXTS = {
    "double quote": b'say "x"', "single quote": b"it's", "back quote": b"`id > pwned`", "curly quotes": "‘x’ “y” «z»".encode(),
    "backslash": b"a\\b\\", "literal u0000": b"a\\u0000b", "literal n": b"a\\nb", "line feed": b"a\n# axis: q", "carriage return": b"a\rb",
    "form feed": b"a\x0cb", "tab": b"a\tb", "NUL": b"a\x00b", "bell": b"a\x07b", "CSI": b"\x1b[31mred\x1b[2J", "OSC title": b"\x1b]0;pwned\x07",
    "C1 CSI": "\u009b31m".encode(), "DEL": b"a\x7fb", "command": b"$(id > pwned)", "semicolon": b"; id > pwned;", "pipe": b"| id > pwned",
    "gnuplot": b"x'; system \"id > pwned\"; set terminal svg name 'x", "element": b"<img src=x onerror=document.title='pwned'>",
    "script": b"</script><script>document.title='pwned'</script>", "attribute": b"x\" onmouseover=\"document.title='pwned'", "comment": b"<!-- x --!>",
    "entity": b"&lt;b&gt;&amp;", "URL": b"javascript:document.title='pwned'", "parent": b"../../etc/passwd", "percent": b"%0a%00%n%s", "format": b"{0} {} %d",
    "SQL": b"'); DROP TABLE prism.rows; --", "formula": b"=cmd|' /C calc'!A0", "plus": b"+1+1", "at": b"@SUM(1)", "topic": b"a+b/#",
    "RTL": "a\u202egnp.exe".encode(), "zero width": "a\u200bb".encode(), "line separator": "a\u2028b".encode(), "byte order mark": b"\xef\xbb\xbfx",
    "not UTF-8": b"a\xff\xfeb", "overlong": b"a\xc0\xafb", "surrogate": b"a\xed\xa0\x80b", "COPY end": b"\\.", "comma": b"a,b;c", "long": b"x" * 200, "1 MB": b"A" * 1_000_000,
}
assert len(TEXTS) >= 40


def is_printable(text):
    try:
        characters = text.decode()
    except UnicodeDecodeError:
        return False
    return all(unicodedata.category(c) not in ("Cc", "Cf", "Zl", "Zp", "Cs") and (ord(c) & 0xFFFE) != 0xFFFE for c in characters)


def is_word(text, most):
    return 1 <= len(text) <= most and all(c in b"abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_" for c in text)


def follows(rule, text):
    ends = text[:1] == b" " or text[-1:] == b" "
    if rule == "axis":
        return is_word(text, 16)
    if rule in ("sensor", "message"):
        parts = text.split(b".")
        return len(text) <= 65 and all(is_word(part, 32) for part in parts) and (rule == "message" or text[:1].isalpha())
    if rule == "name":
        return 1 <= len(text) <= 90 and is_printable(text) and b"/" not in text and text[:1] != b"." and not ends
    if rule == "text":
        return len(text) <= 128 and is_printable(text) and not ends
    return len(text) <= 4096 and is_printable(text)
