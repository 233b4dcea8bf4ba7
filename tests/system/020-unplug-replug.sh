# SPDX-License-Identifier: MIT
# The gyro is unplugged and plugged in again: clients are notified at once, prismd keeps running, the window restarts.
. "$(dirname "$0")/lib.sh"
frames 50
config
sed -i 's/"retry_max_s": 0.2/"retry_max_s": 600/; s/"silence_s": 1/"silence_s": 3600/' "$dir/gyro.json"  # the loss is not the silence
start_sim --profile steady --speed 200
start_prismd
wait_for 20 field_is .sample.quality status good
prismctl watch --json >"$dir/watch" & children+=("$!")
wait_for 5 test -s "$dir/watch"
kill -9 "$sim"; rm "$dir/tty"  # else another test may get its number of pseudo-terminal
wait_for 5 grep -q line_lost "$dir/watch"
wait_for 5 field_is .state status connecting
same "quality of an unplugged gyro" "$(field .quality status) $(field .sample.quality status) $(field .quality bias)" "no_data no_data no_data"
same "values of an unplugged gyro" "$(field .sample.rate_deg_per_h status) $(field .window.bias_deg_per_h status) $(field .corrected_deg_per_h bias)" "null null null"
[ "$(field '.age_s > 0' status)" = true ] || fail "the status has no age of the last data"
wait_for 5 grep -q 'retrying' "$dir/prismd.err"
# The pause between attempts does not double, which would be 600 s soon. Each attempt shows the present reason.
names_link() { field_is '.detail | test("symbolic link")' status "$1"; }
for _ in 1 2 3 4 5 6 7; do
  ln -s "$dir/tty" "$dir/tty"
  wait_for 5 names_link true
  rm "$dir/tty"
  wait_for 5 names_link false
done
start_sim --profile steady --speed 200
wait_for 5 field_is .state status receiving
same "sessions" "$(field .sessions status)" 2
wait_for 20 field_is .sample.quality status good
kill -0 "$prismd" || fail "prismd ended"
same "reports of the loss" "$(grep -c ': lost:' "$dir/prismd.err")" 1
