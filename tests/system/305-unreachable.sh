# SPDX-License-Identifier: MIT
# Alarms for what another program does to prismd: it has the gyro's device open, and it replaces the socket's file. prismd removes
# only its own socket file.
. "$(dirname "$0")/lib.sh"
frames 50
config '"capture": {"directory": "'"$dir"'/capture"}'
start_sim --profile second --speed 1
exec 9<"$dir/tty" # another reader, before prismd claims the device
start_prismd
wait_for 10 field_is .state status receiving
kill -STOP "$sim"
wait_for 10 grep -q 'another program may be reading this device: .*(pid [0-9]*)' "$dir/prismd.err"
grep -q "bash (pid $$)" "$dir/prismd.err" || fail "the reader is not named: $(grep 'another program' "$dir/prismd.err")"
exec 9<&-
kill -CONT "$sim"
wait_for 20 field_is .state status receiving

socket=$dir/gyro.sock
mv "$socket" "$dir/moved.sock"
wait_for 5 grep -q "gyro.sock: the socket's file was removed or replaced" "$dir/prismd.err"
python3 -c "import socket,sys; socket.socket(socket.AF_UNIX).bind(sys.argv[1])" "$socket" # the file of another process
[ "$(grep -c "the socket's file was removed or replaced" "$dir/prismd.err")" = 1 ] || fail "reported more than once"
kill -TERM "$prismd"; wait "$prismd" || fail "exit code $?"
[ -S "$socket" ] || fail "prismd removed the socket of another process"
