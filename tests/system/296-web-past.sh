# SPDX-License-Identifier: MIT
# What prismweb says of the past is what the log and memory have, from whichever of them it comes: after a counter that began anew, where
# retention took the log, and of temperature before and behind a restart. The story: an hour that ended now showed the run before it.
. "$(dirname "$0")/lib.sh"
PATH=$PRISM_BIN/tools/prismweb:$PATH
cd "$dir"
export XDG_RUNTIME_DIR=$dir
frames 10
config
sed -i "s|\"log\": {\"directory\": \"$dir/log\"}|\"log\": {\"directory\": \"$dir/log\", \"segment_mib\": 0.1}|" gyro.json
start_sim --profile fast --speed 400
start_prismd
web_again() {
  : >web.out
  start web prismweb --listen 127.0.0.1:0 --state state --instance "$PRISM_SOCKET"
  web=$pid
  wait_for 5 grep -q token= web.out
  url=$(sed 's/#.*//' web.out)
  token=$(program_token)
}
range() { curl -s -H "Authorization: Bearer $token" "${url}api/gyro/range?$1&points=5000"; }
# rows FROM TO: the times, rates and temperatures of a view by the second
rows() { range "from_s=$1&to_s=$2" | jq -c '[.source, [.columns as $c | .rows[] | [.[0], .[$c | index("rate_min")], .[$c | index("temperature_max")]]]]'; }
web_again
long_enough() { [ "$(range seconds=100 | jq '.last_s - .first_s')" -gt 9000 ]; }
wait_for 45 long_enough
kill -STOP "$sim"  # nothing new comes while the past is looked at
sleep 3
last=$(range seconds=100 | jq .last_s)

# The temperature of a second is that of the log, whether it was heard, or asked for after a restart.
heard=$(rows $((last - 100)) "$last")
same "seconds" "$(jq '.[1] | length' <<<"$heard")" 100
kill -TERM "$web"; wait "$web"
web_again
again() { [ "$(rows $((last - 100)) "$last")" = "$heard" ]; }
wait_for 10 again

first=$(range seconds=100 | jq .first_s)
# The longer the steps, the more lies in the first one: a step that the border cuts is whole, from the seconds and from the minutes.
seconds_of() {  # seconds_of LENGTH POINTS: how many are in the rows, and whether these begin at the border or before it
  curl -s -H "Authorization: Bearer $token" "${url}api/gyro/range?from_s=$((last - $1))&to_s=$last&points=$2" |
    jq -c --argjson from $((last - $1)) '(.columns | index("seconds")) as $i | [([.rows[][$i]] | add), .rows[0][0] - .step_s <= $from]'
}
for length in 7001 8501; do
  fine=$(seconds_of $length 5000 | jq '.[0]')
  for points in 2 7 40 110; do
    coarse=$(seconds_of $length $points)
    same "a view of $length s in $points rows, [seconds, from its border], $fine are known" "$(jq -c --argjson fine "$fine" '[.[0] >= $fine, .[1]]' <<<"$coarse")" '[true,true]'
  done
done

# A view behind all that there is has nothing, and does not end before it begins.
same "of the far future" "$(range from_s=9e9 | jq -c '[.rows, .to_s >= .from_s]')" '[[],true]'

# The counter begins anew: both views have the same seconds of now.
kill -KILL "$sim"; wait "$sim" 2>/dev/null || true
start_sim --profile fast --speed 4 --seed 8
back() { [ "$(range seconds=20 | jq .last_s)" -lt $((last - 3600)) ]; }
wait_for 10 back
sleep 12
kill -STOP "$sim"
sleep 3
now=$(range seconds=20 | jq .last_s)
near=$(rows $((now - 20)) "$now")
same "20 s of now" "$(jq '.[1] | length >= 15' <<<"$near")" true
same "the same in an hour" "$(rows $((now - 3600)) "$now" | jq -c --argjson from $((now - 20)) '[.[1][] | select(.[0] > $from)]')" "$(jq -c '.[1]' <<<"$near")"

# Where retention took the log, the minutes of it are told.
same "of the run before, by the log" "$(rows $((first + 1000)) $((first + 2200)) | jq -c '[.[0], (.[1] | length)]')" '["seconds",1200]'
for segment in $(ls log/*.csv | sort -V | head -3); do rm "$segment"; done
same "and without the log" "$(rows $((first + 1000)) $((first + 2200)) | jq -c '[.[0], (.[1] | length >= 20)]')" '["minutes",true]'
