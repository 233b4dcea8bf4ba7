#!/usr/bin/env bash
# SPDX-License-Identifier: MIT
# Many gyros on one machine: N prismd at 200 frames/s each, with logs; first without clients, then each with a client that
# receives every sample. Prints their total share of one core. A benchmark, not a test: it has no limits.
# usage: instances.sh PROGRAM_DIRECTORY [N] [SECONDS]
set -euo pipefail
bin=${1:?directory of the programs} count=${2:-16} seconds=${3:-20}
source=$(cd "$(dirname "$0")/../.." && pwd)
dir=$(mktemp -d "${TMPDIR:-/tmp}/prism-instances.XXXXXX")
gyros=() daemons=() clients=()
mkfifo "$dir/hold"
exec 9<>"$dir/hold"  # clients run until this is closed
trap 'exec 9>&-; kill "${clients[@]}" "${daemons[@]}" "${gyros[@]}" 2>/dev/null || true; wait 2>/dev/null || true; rm -rf "$dir"' EXIT

for i in $(seq "$count"); do
  "$bin/tools/prismsim/prismsim" --profile steady --speed 1 --seed "$i" --link "$dir/tty$i" >"$dir/sim$i.out" 2>&1 &
  gyros+=($!)
done
for i in $(seq "$count"); do
  until [ -e "$dir/tty$i" ]; do sleep 0.05; done
  cat >"$dir/gyro$i.json" <<END
{"name": "gyro$i", "line": {"device": "$dir/tty$i"}, "frames": "trplg", "model": "$source/config/models/tao2019-model2.json",
 "log": {"directory": "$dir/log"}, "socket": {"path": "$dir/gyro$i.sock"}, "event_level": "error"}
END
  "$bin/daemon/prismd" "$dir/gyro$i.json" &
  daemons+=($!)
done
for i in $(seq "$count"); do until [ -S "$dir/gyro$i.sock" ]; do sleep 0.05; done; done

# Total clock ticks of all daemons, and frames that they have decoded.
ticks() { local pid sum=0 stat; for pid in "${daemons[@]}"; do stat=($(<"/proc/$pid/stat")); sum=$((sum + stat[13] + stat[14])); done; echo $sum; }
frames() { local i; for i in $(seq "$count"); do "$bin/tools/prismctl/prismctl" --socket "$dir/gyro$i.sock" --json line; done | jq -s 'map(.decoder.frames) | add'; }
measure() {  # measure WHAT
  local before after begin end frames_before frames_after resident
  sleep 3
  frames_before=$(frames) before=$(ticks) begin=$(date +%s%N)
  sleep "$seconds"
  after=$(ticks) end=$(date +%s%N) frames_after=$(frames)
  resident=$(for pid in "${daemons[@]}"; do awk '/^Pss:/ {print $2}' "/proc/$pid/smaps_rollup"; done | awk '{s += $1} END {print s / 1024}')
  awk -v what="$1" -v n="$count" -v t=$((after - before)) -v hz="$(getconf CLK_TCK)" -v ns=$((end - begin)) -v f=$((frames_after - frames_before)) -v mb="$resident" 'BEGIN {
    s = ns / 1e9
    printf "%d instances at %.0f frames/s each, %s: %.1f %% of one core in total (target: under 10), %.1f us per frame, %.1f MB in total\n", n, f / n / s, what, 100 * t / hz / s, 1e6 * t / hz / f, mb }'
}

measure "no client"
for i in $(seq "$count"); do
  { printf '{"jsonrpc":"2.0","id":1,"method":"subscribe","params":{"streams":["sample"]}}\n'; cat <"$dir/hold"; } 9>&- |
    socat - "UNIX-CONNECT:$dir/gyro$i.sock" >/dev/null 9>&- &
  clients+=($!)
done
measure "one client each"
