# SPDX-License-Identifier: MIT
# The log is the queue: clients read it by cursor across kills, restarts and retention. A client gets each row of the log once and in
# order; rows that were deleted before its request are counted.
. "$(dirname "$0")/lib.sh"
config
jq '.log.segment_mib = 0.01' gyro.json >small.json && mv small.json gyro.json
of_log() { grep -hv '^[#t]' log/gyro-*.csv; }
start_sim --profile steady --speed 4
start_prismd
start follower prismctl --socket "$PRISM_SOCKET" rows --follow --cursor kept
follower=$pid
for kill in 1 2 3; do
  wait_for 10 field_above .log.rows status 4
  kill -9 "$prismd"; wait "$prismd" 2>/dev/null || true
  [ "$kill" = 2 ] && { sleep 0.3; kill -9 "$follower"; wait "$follower" 2>/dev/null || true; cp follower.out first.out
    start follower prismctl --socket "$PRISM_SOCKET" rows --follow --cursor kept; follower=$pid; }
  start_prismd
done
wait_for 10 field_above .log.rows status 3
kill -TERM "$prismd"; wait "$prismd" || fail "exit code $?"
start_prismd
prismctl rows --cursor mine.cursor >mine 2>mine.err || fail "rows: $(cat mine.err)"
prismctl rows --json --limit 3 2>/dev/null >three
same "rows with --limit 3" "$(wc -l <three)" 3
same "a row's axis, number and value" "$(jq -rs '.[2] | "\(.axis) \(.segment) \(.row) \(.samples | type)"' three)" "z 1 3 number"
followed() { [ "$(cat first.out follower.out | grep -vc ^time_utc)" -ge 16 ]; }
wait_for 10 followed
kill -TERM "$follower"; wait "$follower" 2>/dev/null || true
cat first.out follower.out | grep -v ^time_utc >got
of_log >all
same "duplicate rows" "$(sort got | uniq -d | wc -l)" 0
head -n "$(wc -l <got)" all | cmp - got || fail "the rows of --follow differ from the log: $(diff all got | head -4)"

# A second call continues after the first. An invalid cursor, one of another log or one after the end of the log is rejected.
wait_for 5 field_above .log.rows status "$(field .log.rows status)"
prismctl rows --cursor mine.cursor >>mine 2>/dev/null
grep -v ^time_utc mine >mine.rows
head -n "$(wc -l <mine.rows)" <(of_log) | cmp - mine.rows || fail "the second call does not continue after the first"
refused() { code=0; prismctl rows --after "$2" 2>refused.err >/dev/null || code=$?; same "exit code: $1" "$code" 1; contains "$1" "$(cat refused.err)" "$3"; }
refused "invalid cursor" now 'found cursor "now", expected one that rows returned, "earliest" or "latest"'
refused "another log" "$(sed 's/^......../00000000/' mine.cursor)" "found a cursor of log 00000000"
other='{"jsonrpc":"2.0","id":1,"protocol":2,"method":"rows","params":{"after":"00000000000000000000000000000000-1-1-1"}}'
same "error code for a cursor of another log" "$(first_answer "$other" | jq .error.code)" -32002
refused "after the end" "$(sed 's/-[0-9]*-[0-9]*-[0-9]*$/-99-1-1/' kept)" "which the log does not have"
contains "a wrong limit" "$(ask rows '{"limit": 0}')" 'params:/limit: found 0, expected an integer within 1 to 10000'
contains "two requests at once" "$(first_answer '{"jsonrpc":"2.0","id":1,"protocol":2,"method":"rows","params":{"after":"latest","wait_s":20}}
{"jsonrpc":"2.0","id":2,"protocol":2,"method":"rows"}')" "found a pending request of this client"

contains "a name of 0.3" "$(ask rows '{"name": "audit"}')" 'params:/name: was removed in prism 0.4; pass the cursor of the last response as \"after\"'

# Deleted rows are reported, never silently skipped.
old=$(head -1 kept)
kill -TERM "$prismd"; wait "$prismd"
jq '.log.keep_mib = 1 | .log.segment_mib = 0.01 | .log.keep_days = 1' gyro.json >keep.json && mv keep.json gyro.json
first=$(printf '%s' "$old" | sed 's/-[0-9]*-[0-9]*-[0-9]*$/-1-1-1/')
gone=$(ls log | head -2)
rows_gone=0; for file in $gone; do rows_gone=$((rows_gone + $(grep -cv '^[#t]' "log/$file"))); rm "log/$file"; done
start_prismd
prismctl rows --after "$first" --limit 1 >one 2>one.err
contains "missing rows" "$(cat one.err)" "$((rows_gone - 1)) rows are missing here"
