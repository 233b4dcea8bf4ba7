#!/usr/bin/env bash
# SPDX-License-Identifier: MIT
# Builds the packages of version 0.1 from the history of this repository, unless they exist. usage: packages_of_0.1.sh DIRECTORY
# Prints the directory of the packages; exit code 77 if the history does not contain version 0.1.
set -euo pipefail
last=57a4ccf13983  # the last commit with version 0.1.0
cd "$(dirname "$0")/../.."
mkdir -p "$1"
tree=$(realpath "$1")/tree made=$(realpath "$1")/packages
commit=$(git rev-parse --quiet --verify "$last^{commit}") || { echo "skipped: this clone has no commit $last" >&2; exit 77; }
if ! ls "$made"/prism_*.deb >/dev/null 2>&1; then
  rm -rf "$tree" "$made"
  mkdir -p "$tree" "$made"
  git archive "$commit" | tar -x -C "$tree"
  (cd "$tree" && cmake --preset package && cmake --build --preset package && cpack --preset package -B "$made") >"$1/log" 2>&1 ||
    { tail -20 "$1/log" >&2; exit 1; }
fi
echo "$made"
