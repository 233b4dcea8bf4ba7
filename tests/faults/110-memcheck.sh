# SPDX-License-Identifier: MIT
# No byte is read that was never written, none outside of what was asked for, and nothing is lost: a replay of a minute (long form: a
# day) of 200 frames/s with damage, log, capture and model, and prismctl's questions, under valgrind.
. "$(dirname "$0")/lib.sh"
if sanitized; then skip "this prismd has a sanitizer of its own"; fi
memcheck=(valgrind --quiet --error-exitcode=99 --leak-check=full --show-leak-kinds=definite,indirect --errors-for-leak-kinds=definite,indirect --child-silent-after-fork=yes)
hours=$(long 0.02 24)
config
prismsim --profile second --hours "$hours" --frames "$dir/frames.json" --outliers 60 --lose-frames 1e-4 --damage-bytes 1e-5 \
  --out "$dir/day.pcap" >"$dir/sim.out" 2>"$dir/sim.err"
"${memcheck[@]}" prismd "$dir/gyro.json" --replay "$dir/day.pcap" --out "$dir/log" >"$dir/replay.out" 2>"$dir/replay.err" ||
  fail "the replay under valgrind: exit code $?"
cat "$dir/replay.out"
! grep -q '^==' "$dir/replay.err" || fail "the replay: valgrind spoke"
rows=$(cat "$dir"/log/*.csv | grep -c '^[0-9]')
awk -v rows="$rows" -v hours="$hours" 'BEGIN { exit !(rows > hours * 3600 - 5 && rows < hours * 3600 + 5) }' ||
  fail "$rows rows, expected those of $hours hours"

# And live: opened, asked by every question, reloaded, ended.
start_sim --profile steady --speed 1
start prismd "${memcheck[@]}" prismd "$dir/gyro.json"
prismd=$pid
wait_for 60 field_is .state status receiving
for method in status bias history stats events line version; do ask "$method" >"$dir/answer"; done
kill -HUP "$prismd"
sleep 3
kill -TERM "$prismd"
wait "$prismd" || fail "live under valgrind: exit code $?"
! grep -q '^==' "$dir/prismd.err" || fail "live: valgrind spoke"
