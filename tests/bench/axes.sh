#!/usr/bin/env bash
# SPDX-License-Identifier: MIT
# CPU cost of three axes relative to one: prismd live at 1000 frames/s of a STIM300 (its own rate), with one axis configured
# without "axes", then with all three and the device's nine thermometers, in turn; also the replay of three axes. A benchmark
# without limits. usage: axes.sh PROGRAM_DIRECTORY [ROUNDS] [SECONDS]
set -euo pipefail
bin=${1:?directory of the programs} rounds=${2:-3} seconds=${3:-10}
dir=$(mktemp -d "${TMPDIR:-/tmp}/prism-axes.XXXXXX")
gyro= daemon=
trap 'kill $gyro $daemon 2>/dev/null || true; wait 2>/dev/null || true; rm -rf "$dir"' EXIT
member() { echo "{\"name\": \"imu\", \"frames\": \"stim300\", \"line\": {\"device\": \"$dir/tty\"}, \"log\": {\"directory\": \"$dir/log-$2\"},
  \"socket\": {\"path\": \"$dir/$2.sock\"}, \"event_level\": \"error\", $1}" >"$dir/$2.json"; }
member '"gyro": {"axis": "x"}' one
member '"axes": {"x": {}, "y": {}, "z": {}}' three

ticks() { local stat; stat=($(<"/proc/$daemon/stat")); echo $((stat[13] + stat[14])); }
cost() {  # cost CONFIG: ticks in $seconds s
  "$bin/tools/prismsim/prismsim" --frames stim300 --axis x,y,z --profile steady --speed 1 --link "$dir/tty" >"$dir/sim.out" 2>&1 &
  gyro=$!
  until [ -e "$dir/tty" ]; do sleep 0.05; done
  "$bin/daemon/prismd" "$dir/$1.json" & daemon=$!
  sleep 2
  local before after
  before=$(ticks); sleep "$seconds"; after=$(ticks)
  kill "$daemon" "$gyro"; wait "$daemon" "$gyro" 2>/dev/null || true
  rm -f "$dir/tty"
  echo $((after - before))
}
sum_one=0 sum_three=0
for round in $(seq "$rounds"); do
  one=$(cost one) three=$(cost three)
  echo "live, round $round: one axis $one, three axes $three ticks of CPU in $seconds s"
  sum_one=$((sum_one + one)) sum_three=$((sum_three + three))
done
awk -v a="$sum_one" -v b="$sum_three" 'BEGIN {printf "live at 1000 frames/s: three axes take %.2f of the CPU time of one (target: at most 1.6)\n", b / a}'

"$bin/tools/prismsim/prismsim" --frames stim300 --axis x,y,z --profile steady --hours 0.5 --out "$dir/three.pcap" 2>/dev/null
cat "$dir/three.pcap" >/dev/null
echo "replay of three axes and nine thermometers, one frame per packet (target: at least 2 million frames/s)"
for round in $(seq 5); do "$bin/daemon/prismd" "$dir/three.json" --replay "$dir/three.pcap" --out "$dir/replayed$round" 2>/dev/null | head -1; done
