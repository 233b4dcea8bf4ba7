#!/usr/bin/env bash
# SPDX-License-Identifier: MIT
# Makes packages of a build tree without building it, and tests them with run.sh. usage: build_tree.sh BUILD PROBE
set -euo pipefail
packages=$(mktemp -d "${TMPDIR:-/tmp}/prism-packages.XXXXXX")
trap 'rm -rf "$packages"' EXIT
cpack --config "$1/CPackConfig.cmake" -G DEB -B "$packages" -D CPACK_DEBIAN_COMPRESSION_TYPE=gzip >"$packages/log" 2>&1 ||
  { cat "$packages/log"; exit 1; }
bash "$(dirname "$0")/run.sh" "$packages"/prism_*.deb "$packages"/prism-tools_*.deb "$packages"/prism-relay_*.deb "$packages"/prism-web_*.deb "$2"
