# SPDX-License-Identifier: MIT
"""Joins scripts into one for a page: bundle.py OUT.cpp LIBRARY MODULE…. Modules come after those that they import; their imports and exports
are removed. OUT.cpp also has the hash of the script for the content security policy of the page."""
import base64
import hashlib
import re
import sys


def without_imports(text):
    """Returns a module's text as part of a function, in which the names that it imports are already defined."""
    text = re.sub(r"^import [^;]*;\n", "", text, flags=re.M)
    text = re.sub(r"^export (?=const|let|function|class|async)", "", text, flags=re.M)
    left = re.search(r"^(import|export)\b.*", text, flags=re.M)
    if left:
        sys.exit(f"bundle.py: found '{left[0]}', expected imports to end with ';' and exports of a const, let, function or class")
    return text


def main(out, library, *modules):
    with open(library, encoding="utf-8") as file:
        script = file.read()
    texts = []
    for path in modules:
        with open(path, encoding="utf-8") as file:
            texts.append(without_imports(file.read()))
    script += '\n(function () {\n"use strict";\n' + "\n".join(texts) + "})();\n"
    for end in ("</script", "<!--", ')script"'):
        if end in script.lower():
            sys.exit(f"bundle.py: found '{end}' in the scripts, which would end them in a page")
    hashed = base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()
    with open(out, "w", encoding="utf-8") as file:
        file.write('#include "tools/prismcal/report/chart_json.hpp"\n\nnamespace prism::report {\n\n'
                   f'const char* const kChartScript = R"script({script})script";\n'
                   f'const char* const kChartScriptHash = "sha256-{hashed}";\n\n' "}  // namespace prism::report\n")


main(*sys.argv[1:])
