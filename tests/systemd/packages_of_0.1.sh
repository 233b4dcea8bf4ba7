#!/usr/bin/env bash
# SPDX-License-Identifier: MIT
# Makes the packages of version 0.1 from this repository's own history, once. usage: packages_of_0.1.sh FOLDER
# Prints the folder that holds them; exits with 77 where the history does not reach back that far.
set -euo pipefail
last=57a4ccf13983  # the last commit that calls itself 0.1.0
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
