#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
# Checks that ELF files are hardened: position-independent, RELRO with immediate binding, non-executable stack, stack protector,
# FORTIFY (programs), CET (x86-64).
# usage: hardening.py FILE...: checks these files.
#        hardening.py --build CMAKE COMPILER: builds a small program and a library with tools/cmake/PrismOptions.cmake, without a build
#        type and with each optimised one, and checks them; the program of a Debug build must fail.
import os
import re
import subprocess
import sys
import tempfile

ROOT = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))


def read(path, *options):
    return subprocess.run(["readelf", "--wide", *options, path], capture_output=True, text=True, check=True).stdout


def faults(path):
    """Returns the hardening measures that a file lacks."""
    header, segments, dynamic = read(path, "-h"), read(path, "-l"), read(path, "-d")
    symbols = read(path, "--dyn-syms")
    program = "INTERP" in segments
    missing = []
    if "Type:                              DYN" not in header:
        missing.append("position-independent code")
    if "GNU_RELRO" not in segments:
        missing.append("RELRO")
    if not re.search(r"BIND_NOW|FLAGS_1.*NOW", dynamic):
        missing.append("immediate binding")
    if re.search(r"GNU_STACK.* RWE ", segments):
        missing.append("non-executable stack")
    if "__stack_chk_fail" not in symbols:
        missing.append("stack protector")
    if program and not re.search(r"__\w+_chk@", symbols.replace("__stack_chk_fail", "")):
        missing.append("FORTIFY")
    # Counts endbr64 instructions: files of Debian 12 have no CET note, because its C library has none.
    with open(path, "rb") as file:
        if "X86-64" in header and file.read().count(b"\xf3\x0f\x1e\xfa") < 2:
            missing.append("CET")
    return missing


SOURCE = """#include <cstdio>
#include <cstring>
int main(int count, char** words) {
  char text[32];
  std::strncpy(text, words[0], static_cast<unsigned>(count) + 8);
  std::snprintf(text + 1, sizeof text - 1, "%s", words[0]);
  return std::puts(text) < 0;
}
"""
LIBRARY = """#include <cstring>
__attribute__((visibility("default"))) int sum(const char* words) {
  char text[64];
  std::strncpy(text, words, sizeof text);
  int all = 0;
  for (char letter : text) all += letter;
  return all;
}
"""
CMAKE = """cmake_minimum_required(VERSION 3.25)
project(small LANGUAGES CXX)
include({root}/tools/cmake/PrismOptions.cmake)
add_library(part SHARED library.cpp)
target_link_libraries(part PUBLIC prism_settings)
add_executable(small main.cpp)
target_link_libraries(small PRIVATE prism_settings)
"""


def build(cmake, compiler, kind):
    with tempfile.TemporaryDirectory() as folder:
        for name, text in (("main.cpp", SOURCE), ("library.cpp", LIBRARY), ("CMakeLists.txt", CMAKE.format(root=ROOT))):
            with open(os.path.join(folder, name), "w", encoding="utf-8") as file:
                file.write(text)
        command = [cmake, "-S", folder, "-B", folder + "/build", "-DCMAKE_CXX_COMPILER=" + compiler]
        command += ["-DCMAKE_BUILD_TYPE=" + kind] if kind else []
        for step in (command, [cmake, "--build", folder + "/build"]):
            subprocess.run(step, check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        return {name: faults(folder + "/build/" + name) for name in ("small", "libpart.so")}


def main(words):
    if words[:1] != ["--build"]:
        wrong = {path: faults(path) for path in words}
    else:
        wrong = {}
        for kind in ("", "Release", "RelWithDebInfo", "MinSizeRel"):
            for name, missing in build(words[1], words[2], kind).items():
                wrong[f"{kind or 'no build type'}: {name}"] = missing
        if not build(words[1], words[2], "Debug")["small"]:
            wrong["Debug: small"] = ["missing measure, expected one in an unoptimised program"]
    for path, missing in wrong.items():
        if missing:
            print(f"{path}: found no {', no '.join(missing)}")
    return 1 if any(wrong.values()) or not wrong else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
