# SPDX-License-Identifier: MIT
# The gyro is unplugged and plugged in again: clients are notified within 100 ms, prismd keeps running, the window restarts.
. "$(dirname "$0")/lib.sh"
frames 50
config
sed -i 's/"retry_max_s": 0.2/"retry_max_s": 600/' "$dir/gyro.json"
start_sim --profile steady --speed 200
start_prismd
wait_for 20 field_is .sample.quality status good
prismctl watch --json >"$dir/watch" & children+=("$!")
wait_for 5 test -s "$dir/watch"
kill -9 "$sim"; lost=$(date +%s%N)
wait_for 5 grep -q line_lost "$dir/watch"
delay=$(($(date +%s%N) - lost))
[ "$delay" -lt 200000000 ] || fail "clients were notified after $((delay / 1000000)) ms, expected less than 200 (100 of them for this script)"
wait_for 5 field_is .state status connecting
same "quality of an unplugged gyro" "$(field .quality status) $(field .sample.quality status) $(field .quality bias)" "no_data no_data no_data"
same "values of an unplugged gyro" "$(field .sample.rate_deg_per_h status) $(field .window.bias_deg_per_h status) $(field .corrected_deg_per_h bias)" "null null null"
[ "$(field '.age_s > 0' status)" = true ] || fail "the status has no age of the last data"
rm -f "$dir/tty"
sleep 3.2  # if the pause doubled, the next attempt would be 3 s away
wait_for 5 grep -q 'retrying' "$dir/prismd.err"
start_sim --profile steady --speed 200
wait_for 2 field_is .state status receiving
same "sessions" "$(field .sessions status)" 2
wait_for 20 field_is .sample.quality status good
kill -0 "$prismd" || fail "prismd ended"
same "reports of the loss" "$(grep -c ': lost:' "$dir/prismd.err")" 1
