# SPDX-License-Identifier: MIT
# A blocked disk below prismweb's store of minutes: live data and data in memory are served as before, requests that need the disk fail
# with the reason, begin and end of the fault are logged, and SIGTERM ends prismweb.
# History: one blocked sync stopped every page until systemd killed prismweb.
. "$(dirname "$0")/lib.sh"
config
start_sim --profile steady --speed 20
start_prismd
wait_for 20 field_above .log.rows status 130
echo good >"$dir/disk"
web_again() {
  : >"$dir/web.out"
  start web env LD_PRELOAD="$PRISM_BIN/tests/libdisk_shim.so" PRISM_DISK="$dir/disk" prismweb --listen 127.0.0.1:0 --state "$dir/state" \
    --instance "$PRISM_SOCKET"
  web=$pid
  wait_for 5 grep -q token= "$dir/web.out"
  url=$(sed 's/#.*//' "$dir/web.out")
  token=$(program_token)
}
api() { curl -s --max-time 60 -H "Authorization: Bearer $token" "$url$1"; }
all='api/gyro/range?seconds=100000'
source_is() { [ "$(api "$all" | jq -r '[.source, .building * 1] | @csv')" = "$1" ]; }
newest() { api 'api/gyro/range?seconds=60' | jq .last_s; }
moves_on() { [ "$(newest)" -gt "$1" ]; }

web_again
wait_for 10 source_is '"minutes",1'
[ "$(wc -l <"$dir/web.err")" = 0 ] || fail "messages about a new store: found $(cat "$dir/web.err"), expected none"
echo hang >"$dir/disk"
wait_for 15 grep -q 'the disk has not answered for 5 s; minutes and hours are delayed' "$dir/web.err"
wait_for 5 moves_on "$(newest)"
contains "/metrics" "$(api metrics)" 'prism_up{gyro="gyro"} 1'
same "state" "$(api api/gyro/status | jq -r .state)" receiving
contains "a request that needs the disk" "$(api "$all")" '"the disk has not answered for '
echo good >"$dir/disk"
wait_for 5 grep -q 'the disk answers again' "$dir/web.err"
wait_for 5 source_is '"minutes",1'

# prismweb ends while the disk is blocked; the next one rebuilds the missing minutes.
echo hang >"$dir/disk"
told_again() { [ "$(grep -c 'the disk has not answered' "$dir/web.err")" = 2 ]; }
wait_for 15 told_again
kill -TERM "$web"
wait_for 5 ended "$web"
code=0; wait "$web" || code=$?
same "exit code" "$code" 1
contains "the last line on stderr" "$(tail -1 "$dir/web.err")" "the last minutes will be rebuilt from the log"
echo good >"$dir/disk"
web_again
wait_for 10 source_is '"minutes",1'
rows=$(field .log.rows status)
found=$(api "$all&points=5000" | jq '.columns as $c | [.rows[][$c | index("seconds")]] | add')
[ "$found" -ge "$rows" ] && [ "$found" -le $((rows + 100)) ] || fail "found $found seconds in the store, expected $rows to $((rows + 100))"

# A request that is pending when the disk blocks fails in time.
echo hang >"$dir/disk"
is_refused() { api "$all" | grep -q 'has not answered for 5 s'; }
wait_for 15 is_refused
echo good >"$dir/disk"

# If prismd is stopped and memory holds all data, prismweb serves seconds, also for a view that begins before the data.
wait_for 15 source_is '"minutes",1'
kill -TERM "$prismd"; wait "$prismd" || fail "prismd: exit code $?"
from_memory() { [ "$(api "$all" | jq -r .source)" = seconds ]; }
wait_for 5 from_memory
kill -TERM "$web"; wait "$web" || fail "exit code $?"
