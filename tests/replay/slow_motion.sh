# SPDX-License-Identifier: MIT
# Shared by the replays of shipped frame descriptions.
# slow_motion DESCRIPTION: prints the description with at most 10 frames a second; the counter's ticks are scaled with the rate.
slow_motion() {
  awk -v most=10 '
    function number(line) { sub(/.*: */, "", line); return line + 0 }
    /^  "rate_hz": / { rate = number($0); slower = rate > most ? rate / most : 1; sub(/: *[0-9.e]+/, ": " rate / slower) }
    match($0, /"ticks_per_s": *[0-9.e]+/) {
      ticks = number(substr($0, RSTART, RLENGTH))
      $0 = substr($0, 1, RSTART - 1) sprintf("\"ticks_per_s\": %.12g", ticks / slower) substr($0, RSTART + RLENGTH)
    }
    { print }' "$1"
}
