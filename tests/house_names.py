# SPDX-License-Identifier: MIT
# Rules on names: each file opens the namespace of its module, and no two types have the same full name. Of two types with the same
# name the linker keeps the functions of only one, without a warning; the program then crashes.
import os
import re

ROOMS = ("base/", "compensation/", "drivers/", "config/", "daemon/", "tools/")
# Files whose names are in the namespace prism itself.
VOCABULARY = re.compile(r"^(base/.*|compensation/(sample|sensors)\.[ch]pp)$")

TOKEN = re.compile(
    r"(?P<space>\b(?:inline\s+)?namespace\b\s*(?P<space_name>[\w:]*)[^;={]*\{)"
    r"|(?P<type>\b(?:struct|class|union|enum(?:\s+(?:class|struct))?)\s+(?:(?:\[\[.*?\]\]|alignas\([^)]*\))\s*)*"
    r"(?P<type_name>[A-Za-z_][\w:]*(?:<[^;{}]*>)?)\s*(?:final\s*)?(?::(?!:)[^;{}()]*(?:\([^)]*\)[^;{}()]*)*)?\{)"
    r"|(?P<open>\{)|(?P<close>\})"
)


# The steps of prismcal, whose files are in one folder.
STEPS = "prism::(report|tables|recordings|analysis|design|campaign|commands)"


def room_namespace(path):
    """Returns a pattern of the namespace of a file: the name of its directory, except for directories that only group files of a module."""
    if VOCABULARY.match(path):
        return "prism"
    folder = os.path.dirname(path)
    if folder.startswith("drivers/wire"):
        return "prism::wire"
    return STEPS if folder == "tools/prismcal" else "prism::" + os.path.basename(folder)


def without_preprocessor(code):
    return re.sub(r"^[ \t]*#(?:[^\n]*\\\n)*[^\n]*", lambda match: re.sub(r"[^\n]", " ", match.group()), code, flags=re.M)


def scopes(code):
    """Yields (offset, 'space' or 'type', full name, whether it is anonymous) of each namespace and type at namespace scope."""
    stack = []  # names of open namespaces, '' for an anonymous one, None for any other brace
    for match in TOKEN.finditer(without_preprocessor(code)):
        if match["close"]:
            if stack:
                stack.pop()
            continue
        inside = None not in stack
        if match["space"]:
            stack.append(match["space_name"])
            if inside:
                yield match.start(), "space", "::".join(filter(None, stack)), "" in stack
            continue
        if match["type"] and inside:
            name = re.sub(r"\s+", "", match["type_name"])
            yield match.start(), "type", "::".join([*filter(None, stack), name]), "" in stack
        stack.append(None)


def check_namespaces(path, code):
    """Yields (offset, message) for declarations outside the module's namespace."""
    if not path.startswith(ROOMS):
        return
    room = room_namespace(path)
    for offset, what, name, anonymous in scopes(code):
        fits = name == room or (room != "prism" and re.fullmatch(room + "(::.*)?", name))
        if what == "space" and (name + "::").startswith("prism::") and not fits:
            yield offset, f"opens namespace {name}, expected {room}"
        elif what == "type" and "::" not in name and not anonymous:
            yield offset, f"{name} is not in a namespace, expected {room}"


def types_of(path, code):
    """Yields (offset, full name) of each type with external linkage."""
    if not path.startswith(ROOMS):
        return
    for offset, what, name, anonymous in scopes(code):
        if what == "type" and not anonymous:
            yield offset, name
