# SPDX-License-Identifier: MIT
# stderr is a full pipe without a reader: acquisition continues, prismd responds to requests and ends on SIGTERM.
# History: all three were blocked.
. "$(dirname "$0")/lib.sh"
config
start_sim --profile steady --speed 1
mkfifo "$dir/stderr"
sleep 600 <"$dir/stderr" & children+=("$!")
python3 - "$dir/stderr" <<'END' &
import os, sys, time
pipe = os.open(sys.argv[1], os.O_WRONLY | os.O_NONBLOCK)
try:
    while True: os.write(pipe, b"x")
except BlockingIOError: pass
time.sleep(600)
END
children+=("$!")
sleep 0.5
prismd "$dir/gyro.json" 2>"$dir/stderr" &
prismd=$!
children+=("$prismd")
wait_for 5 prismctl version
wait_for 5 field_is .state status receiving
before=$(field .line.frames status)
for _ in $(seq "$(long 5 60)"); do kill -HUP "$prismd"; prismctl version >/dev/null || fail "no response"; sleep 1; done
[ "$(($(field .line.frames status) - before))" -gt "$(long 800 11000)" ] || fail "frames: $before, then $(field .line.frames status)"
same "frames lost" "$(field .timing.missing_frames status)" 0
begin=$(date +%s%N)
kill -TERM "$prismd"; wait "$prismd" || fail "exit code $?"
took=$((($(date +%s%N) - begin) / 1000000))
[ "$took" -lt 5000 ] || fail "SIGTERM took $took ms, expected less than 5000"
