# SPDX-License-Identifier: MIT
# prismweb returns the same past data from memory, log and store: before and after its restart, after a restart of the counter, and
# after retention deleted the log. Background: a view of the last hour showed the run before the restart of the counter.
. "$(dirname "$0")/lib.sh"
frames 2
config
sed -i "s|\"log\": {\"directory\": \"$dir/log\"}|\"log\": {\"directory\": \"$dir/log\", \"segment_mib\": 0.1}|" gyro.json
start_sim --profile fast --speed 1000
start_prismd
web_state=$dir/state
range() { curl -s -H "Authorization: Bearer $token" "${url}api/gyro/range?$1&points=5000"; }
# rows FROM TO: prints the source, and time, rate and temperature of each row
rows() { range "from_s=$1&to_s=$2" | jq -c '[.source, [.columns as $c | .rows[] | [.[0], .[$c | index("rate_min")], .[$c | index("temperature_max")]]]]'; }
start_web
long_enough() { [ "$(range seconds=100 | jq '.last_s - .first_s')" -gt 9000 ]; }
wait_for 45 long_enough
stop_sim() {  # returns when prismweb has all rows
  kill -STOP "$sim"
  wait_for 10 at_rest
  wait_for 10 has_last_row
}
at_rest() { frames=$(field .line.frames status); sleep 0.3; field_is .line.frames status "$frames"; }
has_last_row() { [ "$(range seconds=20 | jq .last_s)" = "$(tail -n 1 "log/$(ls log | tail -1)" | cut -d, -f2)" ]; }
stop_sim  # no new data during these checks
last=$(range seconds=100 | jq .last_s)

# The temperature of a second is the same when received live and when read from the log after a restart of prismweb.
live=$(rows $((last - 100)) "$last")
same "seconds" "$(jq '.[1] | length' <<<"$live")" 100
kill -TERM "$web"; wait "$web"
start_web
again() { [ "$(rows $((last - 100)) "$last")" = "$live" ]; }
wait_for 10 again

first=$(range seconds=100 | jq .first_s)
# A step that contains the start of the view is complete, whether from seconds or from minutes, so longer steps never contain less.
# seconds_of LENGTH POINTS: prints how many seconds the rows contain, and whether they begin at or before the start of the view
seconds_of() {
  curl -s -H "Authorization: Bearer $token" "${url}api/gyro/range?from_s=$((last - $1))&to_s=$last&points=$2" |
    jq -c --argjson from $((last - $1)) '(.columns | index("seconds")) as $i | [([.rows[][$i]] | add), .rows[0][0] - .step_s <= $from]'
}
for length in 7001 8501; do
  fine=$(seconds_of $length 5000 | jq '.[0]')
  for points in 2 7 40 110; do
    coarse=$(seconds_of $length $points)
    same "a view of $length s in $points rows: [at least $fine seconds, begins at its start]" "$(jq -c --argjson fine "$fine" '[.[0] >= $fine, .[1]]' <<<"$coarse")" '[true,true]'
  done
done

# A view after all data is empty, and its end is not before its start.
same "a view of the far future" "$(range from_s=9e9 | jq -c '[.rows, .to_s >= .from_s]')" '[[],true]'

# The counter restarts: a short and a long view have the same latest seconds.
kill -KILL "$sim"; wait "$sim" 2>/dev/null || true
start_sim --profile fast --speed 20 --seed 8
# The earlier run is served all the time, also while the store does not have the new rows yet. History: then the view had no rows.
earlier() { same "rows of the run before" "$(rows $((last - 1000)) $((last - 500)) | jq '.[1] | length')" 500; }
back() { earlier && [ "$(range seconds=20 | jq .last_s)" -lt $((last - 3600)) ]; }
wait_for 10 back
for _ in $(seq 30); do earlier; done
long_enough() { [ "$(range seconds=20 | jq .last_s)" -gt $((begin + 40)) ]; }
begin=$(range seconds=20 | jq .last_s)
wait_for 15 long_enough
stop_sim
now=$(range seconds=20 | jq .last_s)
near=$(rows $((now - 20)) "$now")
same "the last 20 s" "$(jq '.[1] | length >= 15' <<<"$near")" true
same "the same seconds in a view of an hour" "$(rows $((now - 3600)) "$now" | jq -c --argjson from $((now - 20)) '[.[1][] | select(.[0] > $from)]')" "$(jq -c '.[1]' <<<"$near")"

# After retention deleted segments of the log, prismweb returns their minutes.
run_before() { rows $((first + 1000)) $((first + 2200)) | jq -c "[.[0], (.[1] | length ${1:-})]"; }
from_the_log() { [ "$(run_before)" = '["seconds",1200]' ]; }
wait_for 10 from_the_log  # a store that still reads the log has fewer rows
for segment in $(ls log/*.csv | sort -V | head -3); do rm "$segment"; done
same "the run before, without the log" "$(run_before '>= 20')" '["minutes",true]'
