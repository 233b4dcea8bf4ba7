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
except BlockingIOError: open(sys.argv[1] + ".full", "w").close()
time.sleep(600)
END
children+=("$!")
wait_for 5 test -e "$dir/stderr.full"
prismd "$dir/gyro.json" 2>"$dir/stderr" &
prismd=$!
children+=("$prismd")
wait_for 5 prismctl version
wait_for 5 field_is .state status receiving
before=$(field .line.frames status)
for _ in $(seq "$(long 5 60)"); do kill -HUP "$prismd"; prismctl version >/dev/null || fail "no response"; sleep 0.3; done
wait_for "$(long 5 60)" field_above .line.frames status $((before + $(long 400 11000)))
same "frames lost" "$(field .timing.missing_frames status)" 0
kill -TERM "$prismd"
wait_for 5 ended "$prismd"
wait "$prismd" || fail "exit code $?"
