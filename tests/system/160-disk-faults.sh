# SPDX-License-Identifier: MIT
# Deleted directories, a file instead of a directory, stderr without a reader: prismd reports disk faults once and continues.
# It does not start if another process listens on its socket, even one that accepts no connection.
. "$(dirname "$0")/lib.sh"
frames 20
config "\"capture\": {\"directory\": \"$dir/capture\"}"

python3 - "$PRISM_SOCKET" <<'END' &
import socket, sys, time
held = socket.socket(socket.AF_UNIX); held.bind(sys.argv[1]); held.listen(0)
clients = []
while True:
    clients.append(socket.socket(socket.AF_UNIX)); clients[-1].setblocking(False)
    try: clients[-1].connect(sys.argv[1])
    except BlockingIOError: break
open(sys.argv[1] + ".full", "w").close()
time.sleep(600)
END
holder=$!
children+=("$holder")
wait_for 5 test -e "$PRISM_SOCKET.full"
code=0; timeout 60 prismd "$dir/gyro.json" 2>"$dir/held" || code=$?
same "exit code for a socket of a process that accepts no connection" "$code" 1
contains "its error" "$(cat "$dir/held")" "another process listens there"
kill "$holder"; rm "$PRISM_SOCKET"

start_sim --profile steady --speed 5
mkfifo "$dir/stderr"
prismd "$dir/gyro.json" 2>"$dir/stderr" &
prismd=$!
children+=("$prismd")
head -n 1 "$dir/stderr" >/dev/null   # from now on stderr has no reader
wait_for 5 prismctl version
for _ in 1 2 3; do kill -HUP "$prismd"; done
wait_for 5 field_is .state status receiving
kill -0 "$prismd" || fail "prismd ended because stderr has no reader"
kill "$prismd"; wait "$prismd" || fail "exit code $?"

rm -rf "$dir/log" "$dir/capture"
start_prismd
written() { [ "$(cat "$dir"/log/*.csv 2>/dev/null | grep -c '^[0-9]')" -ge 2 ]; }
captured() { find "$dir/capture" -name '*.pcap' -size +0 | grep -q .; }
wait_for 10 written
wait_for 10 captured
rm -r "$dir/log" "$dir/capture"
: >"$dir/log"
wait_for 10 grep -q 'log: .*was deleted or moved away' "$dir/prismd.err"
wait_for 10 grep -q 'capture: .*was deleted or moved away' "$dir/prismd.err"
wait_for 10 field_above .log.dropped status 3
same "reports of a file instead of the directory" "$(grep -c 'log: .*cannot be created: Not a directory; rows are dropped' "$dir/prismd.err")" 1
rm "$dir/log"
wait_for 10 grep -q 'log: writing again after' "$dir/prismd.err"
wait_for 10 written
wait_for 10 captured
same "state" "$(field .state status)" receiving
