#!/usr/bin/env bash
# SPDX-License-Identifier: MIT
# Builds the packages of version 0.1 or 0.3 from the history of this repository, unless they exist. usage: packages_of.sh VERSION DIRECTORY
# Prints the directory of the packages; exit code 77 if the history does not contain the version.
set -euo pipefail
case "${1:-}" in  # the last commit of the version
  0.1) last=57a4ccf13983 ;;
  0.3) last=5c3eef79 ;;
  *) echo "packages_of.sh: found version '${1:-}', expected 0.1 or 0.3" >&2; exit 64 ;;
esac
cd "$(dirname "$0")/../.."
mkdir -p "$2"
tree=$(realpath "$2")/tree made=$(realpath "$2")/packages
commit=$(git rev-parse --quiet --verify "$last^{commit}") || { echo "skipped: this clone has no commit $last" >&2; exit 77; }
if ! ls "$made"/prism_*.deb >/dev/null 2>&1; then
  rm -rf "$tree" "$made"
  mkdir -p "$tree" "$made"
  git archive "$commit" | tar -x -C "$tree"
  (cd "$tree" && cmake --preset package && cmake --build --preset package && cpack --preset package -B "$made") >"$2/log" 2>&1 ||
    { tail -20 "$2/log" >&2; exit 1; }
fi
echo "$made"
