# SPDX-License-Identifier: MIT
# A replay of PRISM_DAYS simulated days (0.25; long form: 30) needs at most 2 MB more memory than a replay of an hour; its log has
# every second once and no damage.
. "$(dirname "$0")/lib.sh"
days=${PRISM_DAYS:-$(long 0.25 30)}
frames 2
config '"capture": {"directory": "'"$dir"'/unused"}'
sed -i 's/"log": {/"log": {"segment_hours": 24, "keep_days": 400, /' "$dir/gyro.json"

# replayed NAME HOURS: replays HOURS simulated hours; prints prismd's peak memory, kB.
replayed() {
  prismsim --profile second --hours "$2" --frames "$dir/frames.json" --out "$dir/$1.pcap" >/dev/null 2>"$dir/sim.err" ||
    fail "prismsim: $(cat "$dir/sim.err")"
  python3 - prismd "$dir/gyro.json" --replay "$dir/$1.pcap" --out "$dir/$1" >"$dir/$1.out" 2>"$dir/$1.err" <<'END_OF_PYTHON' ||
import os, resource, sys
child = os.fork()
if child == 0: os.execvp(sys.argv[1], sys.argv[1:])
_, status, usage = os.wait4(child, 0)
print(usage.ru_maxrss)
sys.exit(os.waitstatus_to_exitcode(status))
END_OF_PYTHON
    fail "replay of $2 hours: $(cat "$dir/$1.err")"
  tail -1 "$dir/$1.out"
}

hour=$(replayed hour 1)
hours=$(awk -v days="$days" 'BEGIN { print days * 24 }')
all=$(replayed all "$hours")
echo "peak memory of prismd: $hour kB for an hour, $all kB for $days days"
sanitized || [ "$all" -lt $((hour + 2048)) ] || fail "found $all kB for $days days, expected at most 2 MB above the $hour kB for an hour"
prismcal verify "$dir/all" --json >"$dir/verify.json" || fail "the log: $(jq -c '.findings[] | select(.fault)' "$dir/verify.json")"
same "sessions" "$(jq '.sessions | length' "$dir/verify.json")" 1
same "seconds without a row" "$(jq '.sessions[0].missing_s' "$dir/verify.json")" 0
rows=$(jq '.sessions[0].rows' "$dir/verify.json")
awk -v rows="$rows" -v hours="$hours" 'BEGIN { exit !(rows > hours * 3600 - 3 && rows < hours * 3600 + 3) }' ||
  fail "found $rows rows, expected one per second of $hours hours"
