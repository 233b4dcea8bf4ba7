# SPDX-License-Identifier: MIT
# valgrind finds no uninitialised read, no access outside allocated memory and no leak: in a replay of 72 s (long form: a day) of
# 200 frames/s with damage, and live with requests and a reload.
. "$(dirname "$0")/lib.sh"
if sanitized; then skip "this prismd is built with a sanitizer"; fi
memcheck=(valgrind --quiet --error-exitcode=99 --leak-check=full --show-leak-kinds=definite,indirect --errors-for-leak-kinds=definite,indirect --child-silent-after-fork=yes)
hours=$(long 0.02 24)
config
prismsim --profile second --hours "$hours" --frames "$dir/frames.json" --outliers 60 --lose-frames 1e-4 --damage-bytes 1e-5 \
  --out "$dir/day.pcap" >"$dir/sim.out" 2>"$dir/sim.err"
"${memcheck[@]}" prismd "$dir/gyro.json" --replay "$dir/day.pcap" --out "$dir/log" >"$dir/replay.out" 2>"$dir/replay.err" ||
  fail "replay under valgrind: exit code $?"
cat "$dir/replay.out"
! grep -q '^==' "$dir/replay.err" || fail "replay: valgrind reported errors"
rows=$(cat "$dir"/log/*.csv | grep -c '^[0-9]')
awk -v rows="$rows" -v hours="$hours" 'BEGIN { exit !(rows > hours * 3600 - 5 && rows < hours * 3600 + 5) }' ||
  fail "found $rows rows, expected one per second of $hours hours"

# Live: opens the line, responds to requests, reloads and ends.
start_sim --profile steady --speed 1
start prismd "${memcheck[@]}" prismd "$dir/gyro.json"
prismd=$pid
wait_for 60 field_is .state status receiving
for method in status bias history stats events line version; do ask "$method" >"$dir/answer"; done
kill -HUP "$prismd"
wait_for 20 grep -q "reloaded: " "$dir/prismd.err"
kill -TERM "$prismd"
wait "$prismd" || fail "live under valgrind: exit code $?"
! grep -q '^==' "$dir/prismd.err" || fail "live: valgrind reported errors"
